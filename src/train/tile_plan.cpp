#include "tile_plan.hpp"

#include <algorithm>
#include <cmath>

#include <gdfmap/core/morton.hpp>
#include <gdfmap/store/surroundings.hpp>

namespace gdfmap {
namespace {

/// From the centre of a cube to the farthest of its samples, in edges.
const double kHalfDiagonal = std::sqrt(3.0) * (0.5 + kMarginRatio);

/// Tiles around a tile in which a point can bring one of its level-0 cubes to life.
int candidate_radius(double threshold_in_cubes) {
  return static_cast<int>(std::ceil(threshold_in_cubes / kCubesPerTileAxis));
}

/// Tiles around a tile in which a point can change a target of level 0: a fitted cube's centre is
/// within the threshold of a point, its samples within half the diagonal of cube and margin of its
/// centre, and they reach one margin out of the tile.
double fine_dependence(double threshold_in_cubes) {
  return threshold_in_cubes + kHalfDiagonal + kMarginRatio;
}

/// The same for coarser levels, in their edges: an occupied level-0 cube is within kCoarseReach of
/// the margin box, its point within its own diagonal of that, and any sample within the margin
/// box's diagonal. Whether a cube is hidden depends on finer ones up to half an edge away and on
/// what those depend on.
double coarse_dependence(double threshold_in_cubes) {
  const double of_targets =
      kCoarseReach + std::sqrt(3.0) / kLevelRatio + 2.0 * kHalfDiagonal + kMarginRatio;
  return std::max(of_targets, 0.5 + fine_dependence(threshold_in_cubes) / kLevelRatio +
                                  of_targets / kLevelRatio);
}

int dependence_radius(int level, double threshold_in_cubes) {
  const double cubes =
      level == 0 ? fine_dependence(threshold_in_cubes) : coarse_dependence(threshold_in_cubes);
  return static_cast<int>(std::ceil(cubes / kCubesPerTileAxis));
}

/// Box of the centres of a tile's cubes, in cubes.
Box3 centre_box(const TileKey& tile) {
  const Vector3 low = kCubesPerTileAxis * Vector3(tile.x, tile.y, tile.z) + Vector3::Constant(0.5);
  return {low, low + Vector3::Constant(kCubesPerTileAxis - 1)};
}

/// The occupied tiles and those near enough to have empty cubes to fit.
TileMasks fine_candidates(std::span<const TilePoints> occupied, double threshold_in_cubes) {
  TileMasks populated;
  const int radius = candidate_radius(threshold_in_cubes);
  for (const TilePoints& tile : occupied) {
    populated.insert_or_assign(tile.key, tile.cubes);
    const Box3 box = box_of_cubes(tile.key, tile.cubes);
    for (int x = -radius; x <= radius; ++x) {
      for (int y = -radius; y <= radius; ++y) {
        for (int z = -radius; z <= radius; ++z) {
          const TileKey neighbour{0, tile.key.x + x, tile.key.y + y, tile.key.z + z};
          if (centre_box(neighbour).exteriorDistance(box) <= threshold_in_cubes) {
            populated.try_emplace(neighbour);
          }
        }
      }
    }
  }
  return populated;
}

bool morton_before(const CandidateTile& a, const CandidateTile& b) {
  return in_morton_order(a.key, b.key);
}

}  // namespace

TilePlan::TilePlan(int level, std::span<const TilePoints> occupied, const Lattice& lattice,
                   const FitConfig& config, const TileMasks& finer_served)
    : groups_(level, occupied) {
  const double threshold = config.empty_distance_threshold / lattice.cube_size();
  dependence_radius_ = dependence_radius(level, threshold);
  if (level == 0) {
    for (const auto& [key, populated] : fine_candidates(occupied, threshold)) {
      tiles_.push_back({key, populated, {}, {}});
    }
  } else {
    for (const auto& [key, cubes] : coarse_cubes(level, occupied, finer_served)) {
      tiles_.push_back({key, cubes.populated, cubes.wanted, {}});
    }
  }
  for (CandidateTile& tile : tiles_) {
    tile.surroundings = surroundings_digest(tile.key, surroundings(tile.key));
  }
  std::sort(tiles_.begin(), tiles_.end(), morton_before);
}

}  // namespace gdfmap
