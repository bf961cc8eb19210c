#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include <gdfmap/pipeline/evaluate.hpp>

namespace gdfmap::cli {

/// A table of errors (metres) over all samples and its parts, and what was left out.
[[nodiscard]] std::string evaluation_text(const Evaluation& evaluation);
[[nodiscard]] nlohmann::ordered_json evaluation_json(const Evaluation& evaluation);

}  // namespace gdfmap::cli
