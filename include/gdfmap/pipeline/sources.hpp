#pragma once

#include <string>

#include <gdfmap/tiling/point_store.hpp>

namespace gdfmap {

/// The published source that people mean: a whole number is its id, anything else its path as it
/// was given at ingest.
/// @throws Error kUsage when there is none, or several of this path, whose ids the message tells.
[[nodiscard]] SourceRecord select_source(PointStore& store, const std::string& id_or_path);

}  // namespace gdfmap
