#pragma once

#include <span>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/store/tile_record.hpp>

namespace gdfmap {

/// The smallest root sigma (√m) that a tile may hold: 2⁻³¹, so that 1/s⁴ is a finite float.
inline constexpr float kMinRootSigma = 0x1p-31f;

/// The cubes of a tile as schema/tile_format.md specifies. Key and digests are stored beside the
/// blob.
/// @throws Error kInternal for a record that the format cannot hold: indices out of order or range,
///         a parameter that is not finite or, quantised, not on the grid, a root sigma below
///         kMinRootSigma, status, failure and number of Gaussians that contradict each other.
[[nodiscard]] Bytes encode_tile(const TileRecord& tile);

/// @throws Error kCorrupt for bytes that encode_tile cannot have written.
/// @returns codec, edge and cubes of the record; key and digests are those of no tile
[[nodiscard]] TileRecord decode_tile(std::span<const std::byte> bytes);

/// Digest of what a tile says of the field (level, key and per cube index, status, errors, stored
/// parameters) and of nothing else: equal fields, equal digests, whatever path led there.
[[nodiscard]] Digest content_digest(const TileRecord& tile);

}  // namespace gdfmap
