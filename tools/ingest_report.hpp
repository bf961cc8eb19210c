#pragma once

#include <span>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include <gdfmap/tiling/ingest.hpp>

namespace gdfmap::cli {

/// One source of a map: id, path, options and what became of its points.
[[nodiscard]] std::string source_text(const SourceRecord& source);
[[nodiscard]] nlohmann::ordered_json source_json(const SourceRecord& source);

/// What became of one cloud, for people.
[[nodiscard]] std::string ingest_text(const IngestReport& report);
/// The same for several: one entry a source, and the sums over those that were new.
[[nodiscard]] nlohmann::ordered_json ingest_json(std::span<const IngestReport> reports);

}  // namespace gdfmap::cli
