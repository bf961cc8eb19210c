#pragma once

#include <filesystem>
#include <memory>

#include <gdfmap/query/distance_field.hpp>

namespace gdfmap {

/// The field of a map's directory, or of a GDF1 or CSV file read into memory.
/// @throws Error kIo when there is neither; kCorrupt.
[[nodiscard]] std::shared_ptr<TileSource> open_tile_source(const std::filesystem::path& path);

}  // namespace gdfmap
