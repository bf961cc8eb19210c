#pragma once

#include <span>
#include <vector>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/store/tile_record.hpp>

namespace gdfmap {

/// What a tile was made from, as schema/tile_format.md specifies it. The tiles are of its level, in
/// key order, from 128 tiles before to 127 behind along each axis.
/// @throws Error kInternal for others.
[[nodiscard]] Bytes encode_surroundings(const TileKey& tile,
                                        std::span<const SurroundingTile> surroundings);

/// @throws Error kCorrupt for bytes that encode_surroundings cannot have written.
[[nodiscard]] std::vector<SurroundingTile> decode_surroundings(const TileKey& tile,
                                                               std::span<const std::byte> bytes);

/// Of the encoded form: what a tile's row keeps, and what is compared to see whether it is stale.
[[nodiscard]] Digest surroundings_digest(const TileKey& tile,
                                         std::span<const SurroundingTile> surroundings);

}  // namespace gdfmap
