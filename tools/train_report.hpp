#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include <gdfmap/train/train.hpp>

namespace gdfmap::cli {

/// What one run of train did. @param seconds  that it took
[[nodiscard]] std::string train_text(const TrainReport& report, double seconds);
[[nodiscard]] nlohmann::ordered_json train_json(const TrainReport& report, double seconds);

/// @param num_failed  cubes without a fit
/// @throws Error kCondition when there are any.
void throw_if_cubes_failed(const std::filesystem::path& map, std::int64_t num_failed);

}  // namespace gdfmap::cli
