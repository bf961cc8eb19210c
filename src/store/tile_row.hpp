#pragma once

#include <span>
#include <string>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/cube_mask.hpp>
#include <gdfmap/db/database.hpp>
#include <gdfmap/store/cube_store.hpp>

namespace gdfmap {

/// The columns of `tiles` that make a TileState, in the order in which read_state() expects them.
inline constexpr char kStateColumns[] =
    "level, x, y, z, surroundings, configuration, content, served, num_cubes, num_populated, "
    "num_poor, num_failed, num_gaussians, num_measured, mean_mae, max_mae, num_bytes";
inline constexpr int kNumStateColumns = 17;

/// One coordinate of a tile's key. @throws Error kCorrupt when no tile can have it.
[[nodiscard]] std::int32_t read_coordinate(const db::Statement& row, int column,
                                           const std::string& database_name);

/// Columns 0 to 16 of the statement's row.
/// @throws Error kCorrupt when the row holds a key or a count that no tile has.
[[nodiscard]] TileState read_state(const db::Statement& row, const std::string& database_name);

/// kStateColumns and the encoded tile, from `tiles` left-joined with `tile_blobs`.
inline constexpr char kTileColumns[] = "checksum, surrounding_tiles, data";

/// The tile of a row that begins with kStateColumns and goes on with kTileColumns.
/// @throws Error kCorrupt when it has no cubes.
[[nodiscard]] EncodedTile read_tile(const db::Statement& row, const TileState& state);

/// @throws Error kCorrupt when the tile cannot be trusted.
[[nodiscard]] TileRecord decode(const EncodedTile& tile);

/// What the row of a tile says of its cubes; the rest of the state is left alone.
/// @param num_bytes  size of the encoded cubes
[[nodiscard]] TileState summarize(const TileRecord& tile, std::size_t num_bytes);

/// @throws Error kCorrupt, beginning with `place`, unless there are 64 bytes.
[[nodiscard]] Bytes encode_mask(const CubeMask& mask);
[[nodiscard]] CubeMask decode_mask(std::span<const std::byte> bytes, const std::string& place);

/// "tile 0,1,-2,3", as the program's options write it: level, x, y, z.
[[nodiscard]] std::string tile_name(const TileKey& key);

}  // namespace gdfmap
