#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include <gdfmap/tiling/block_codec.hpp>

namespace gdfmap {

using VisitPoints = std::function<void(std::span<const TileOffset>)>;

/// Visits some decoded blocks of one tile, the same each time it is called.
using BlockScan = std::function<void(const VisitPoints&)>;

struct MergeCounts {
  std::uint64_t num_duplicates = 0;  ///< equal to another point
  std::uint64_t num_thinned = 0;     ///< given up for another point of their voxel
};

/// Visits the union of the blocks in pieces, in Morton order, each point once, and thinned. Scans
/// once where there are at most kMaxPiecePoints, else once for every piece and once more to find
/// the pieces, so that memory is bounded by them or by the points of the fullest cube.
/// @param num_points   of all blocks together
/// @param voxel_steps  as thin() takes it
MergeCounts merge_blocks(const BlockScan& scan, std::uint64_t num_points, int voxel_steps,
                         const VisitPoints& visit);

inline constexpr std::uint64_t kMaxPiecePoints = std::uint64_t{1} << 20;

}  // namespace gdfmap
