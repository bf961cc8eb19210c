#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include <gdfmap/pipeline/ingest.hpp>

namespace gdfmap::cli {

/// "about 1,200 cubes, 1.5 MiB, 2.0 s on one core"
[[nodiscard]] std::string estimate_text(const TrainingEstimate& estimate);
[[nodiscard]] nlohmann::ordered_json estimate_json(const TrainingEstimate& estimate);

}  // namespace gdfmap::cli
