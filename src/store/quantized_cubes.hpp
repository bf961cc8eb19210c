#pragma once

#include <cstddef>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/store/tile_record.hpp>

namespace gdfmap {

/// Appends the cubes of a tile in the quantised codec (schema/tile_format.md, codec 1).
/// @param tile  whose cubes keep the rules of every codec
/// @throws Error kInternal naming a cube that is not on the codec's grids
void put_quantized_cubes(ByteWriter& writer, const TileRecord& tile);

/// Reads them, with the edge. What every codec demands of a cube is left to the caller.
/// @param num_cubes, num_gaussians  as the tile's header states them
/// @throws Error kCorrupt for bytes that put_quantized_cubes() cannot have written
void get_quantized_cubes(ByteReader& reader, std::size_t num_cubes, std::size_t num_gaussians,
                         TileRecord& tile);

}  // namespace gdfmap
