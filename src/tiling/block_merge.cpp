#include "block_merge.hpp"

#include <array>
#include <vector>

#include <gdfmap/core/morton.hpp>

#include "voxel_thinning.hpp"

namespace gdfmap {
namespace {

/// The rank of a point's cube in Morton order, so that a run of ranks is a run of points.
std::size_t cube_rank(const TileOffset& p) {
  return static_cast<std::size_t>(
      morton_code(p.x / kStepsPerCubeAxis, p.y / kStepsPerCubeAxis, p.z / kStepsPerCubeAxis));
}

/// Cubes [begin, end) by rank.
struct Piece {
  std::size_t begin = 0, end = kCubesPerTile;
  std::uint64_t num_points = 0;

  [[nodiscard]] bool is_whole_tile() const { return begin == 0 && end == kCubesPerTile; }
  [[nodiscard]] bool contains(const TileOffset& p) const {
    const std::size_t rank = cube_rank(p);
    return rank >= begin && rank < end;
  }
};

/// Runs of cubes with at most kMaxPiecePoints each, or of a single cube.
std::vector<Piece> divide(const BlockScan& scan, std::uint64_t num_points) {
  if (num_points <= kMaxPiecePoints) return {{.num_points = num_points}};
  std::array<std::uint64_t, kCubesPerTile> counts{};
  scan([&](std::span<const TileOffset> points) {
    for (const TileOffset& p : points) ++counts[cube_rank(p)];
  });
  std::vector<Piece> pieces;
  for (std::size_t rank = 0; rank < counts.size(); ++rank) {
    if (pieces.empty() || pieces.back().num_points + counts[rank] > kMaxPiecePoints) {
      pieces.push_back({.begin = rank});
    }
    pieces.back().end = rank + 1;
    pieces.back().num_points += counts[rank];
  }
  return pieces;
}

std::vector<TileOffset> collect(const BlockScan& scan, const Piece& piece) {
  std::vector<TileOffset> points;
  points.reserve(piece.num_points);
  scan([&](std::span<const TileOffset> block) {
    if (piece.is_whole_tile()) {
      points.insert(points.end(), block.begin(), block.end());
      return;
    }
    for (const TileOffset& p : block) {
      if (piece.contains(p)) points.push_back(p);
    }
  });
  return points;
}

}  // namespace

MergeCounts merge_blocks(const BlockScan& scan, std::uint64_t num_points, int voxel_steps,
                         const VisitPoints& visit) {
  MergeCounts counts;
  for (const Piece& piece : divide(scan, num_points)) {
    if (piece.num_points == 0) continue;
    std::vector<TileOffset> points = collect(scan, piece);
    const std::size_t num_all = points.size();
    sort_unique(points);
    const std::size_t num_unique = points.size();
    thin(points, voxel_steps);
    counts.num_duplicates += num_all - num_unique;
    counts.num_thinned += num_unique - points.size();
    visit(points);
  }
  return counts;
}

}  // namespace gdfmap
