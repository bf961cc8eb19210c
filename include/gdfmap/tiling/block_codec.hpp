#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/cube_mask.hpp>

namespace gdfmap {

/// A point within its level-0 tile, in quantisation steps from the tile's minimum corner.
struct TileOffset {
  std::uint16_t x = 0, y = 0, z = 0;
  auto operator<=>(const TileOffset&) const = default;

  /// The cube of the tile that holds the point.
  [[nodiscard]] int cube() const {
    return cube_index(x / kStepsPerCubeAxis, y / kStepsPerCubeAxis, z / kStepsPerCubeAxis);
  }
};

/// Points of one block beyond which a buffer is written out; also the decoder's limit.
inline constexpr std::size_t kMaxBlockPoints = std::size_t{1} << 16;

/// Sorts points by Morton code and removes duplicates, in place. Radix sort on precomputed codes.
void sort_unique(std::vector<TileOffset>& points);

/// Bytes of a block, as schema/block_format.md specifies: Morton-sorted, differences along each
/// axis in a prefix code of their length. `points` are as sort_unique leaves them, at most
/// kMaxBlockPoints.
[[nodiscard]] Bytes encode_block(std::span<const TileOffset> points);

/// The points of a block. @throws Error kCorrupt for any bytes that encode_block cannot have
/// written; never reads or allocates beyond kMaxBlockPoints.
[[nodiscard]] std::vector<TileOffset> decode_block(std::span<const std::byte> bytes);

}  // namespace gdfmap
