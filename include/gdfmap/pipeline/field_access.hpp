#pragma once

#include <filesystem>
#include <memory>
#include <span>

#include <gdfmap/query/distance_field.hpp>

namespace gdfmap {

/// The field of a map's directory, or of a GDF1 or CSV file read into memory.
/// @throws Error kIo when there is neither; kCorrupt.
[[nodiscard]] std::shared_ptr<TileSource> open_tile_source(const std::filesystem::path& path);

/// Box of the cubes that hold points, world frame, metres; empty when there are none.
[[nodiscard]] Box3 occupied_bounds(std::span<const OccupiedTile> tiles, const Lattice& lattice);

}  // namespace gdfmap
