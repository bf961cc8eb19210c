#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include <gdfmap/train/train.hpp>

namespace gdfmap::cli {

/// What one run of train did. @param seconds  that it took
[[nodiscard]] std::string train_text(const TrainReport& report, double seconds);
[[nodiscard]] nlohmann::ordered_json train_json(const TrainReport& report, double seconds);

/// Of the map, not of one run: running again does not turn a failure into a success.
/// @throws Error kCondition when a cube of the map has no fit.
void throw_if_cubes_failed(Map& map);

}  // namespace gdfmap::cli
