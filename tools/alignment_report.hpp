#pragma once

#include <span>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include <gdfmap/pipeline/aligned_ingest.hpp>

namespace gdfmap::cli {

/// What became of the alignment of one cloud, for people.
[[nodiscard]] std::string alignment_text(const AlignmentReport& report);
[[nodiscard]] nlohmann::ordered_json alignment_json(const AlignmentReport& report);

/// @throws Error kCondition naming the first cloud that was not accepted.
void throw_if_not_aligned(std::span<const AlignmentReport> reports);

}  // namespace gdfmap::cli
