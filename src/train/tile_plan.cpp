#include "tile_plan.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/morton.hpp>

namespace gdfmap {
namespace {

using OccupiedIndex = std::unordered_map<TileKey, const TilePoints*, TileKeyHash>;

/// Calls visit(key) for the tiles within `radius` of a tile, itself included, in key order.
template <typename Visit>
void for_each_neighbour(const TileKey& key, int radius, const Visit& visit) {
  for (int x = -radius; x <= radius; ++x) {
    for (int y = -radius; y <= radius; ++y) {
      for (int z = -radius; z <= radius; ++z) {
        visit(TileKey{key.level, key.x + x, key.y + y, key.z + z});
      }
    }
  }
}

/// Tiles around a tile in which a point can bring one of its cubes to life.
int candidate_radius(double threshold_in_cubes) {
  return static_cast<int>(std::ceil(threshold_in_cubes / kCubesPerTileAxis));
}

/// Tiles around a tile in which a point can change a target: a fitted cube's centre is within the
/// threshold of a point, its samples within half the diagonal of cube and margin of its centre, and
/// they reach one margin out of the tile.
int dependence_radius(double threshold_in_cubes) {
  const double half_diagonal = std::sqrt(3.0) * (0.5 + kMarginRatio);
  return static_cast<int>(
      std::ceil((threshold_in_cubes + half_diagonal + kMarginRatio) / kCubesPerTileAxis));
}

/// Box of the occupied cubes of a tile, in cubes from the world's origin.
Box3 occupied_box(const TilePoints& tile) {
  Box3 box;
  for (int i = 0; i < kCubesPerTile; ++i) {
    if (!tile.cubes.test(i)) continue;
    const CubeKey cube = cube_at(tile.key, i);
    const Vector3 low(static_cast<double>(cube.x), static_cast<double>(cube.y),
                      static_cast<double>(cube.z));
    box.extend(low).extend(low + Vector3::Ones());
  }
  return box;
}

/// Box of the centres of a tile's cubes, in cubes.
Box3 centre_box(const TileKey& tile) {
  const CubeKey first = cube_at(tile, 0);
  const Vector3 low = Vector3(static_cast<double>(first.x), static_cast<double>(first.y),
                              static_cast<double>(first.z)) +
                      Vector3::Constant(0.5);
  return {low, low + Vector3::Constant(kCubesPerTileAxis - 1)};
}

Digest surroundings_digest(const TileKey& key, int radius, const OccupiedIndex& occupied) {
  ByteWriter writer;
  for_each_neighbour(key, radius, [&](const TileKey& neighbour) {
    const auto found = occupied.find(neighbour);
    if (found == occupied.end()) return;
    writer.put(neighbour.x);
    writer.put(neighbour.y);
    writer.put(neighbour.z);
    writer.put(found->second->digest);
  });
  return hash128(writer.bytes());
}

bool morton_before(const CandidateTile& a, const CandidateTile& b) {
  return morton_less({a.key.x, a.key.y, a.key.z}, {b.key.x, b.key.y, b.key.z});
}

}  // namespace

std::vector<CandidateTile> plan_tiles(std::span<const TilePoints> occupied, const Lattice& lattice,
                                      const FitConfig& config) {
  const double threshold = config.empty_distance_threshold / lattice.cube_size();
  OccupiedIndex index;
  for (const TilePoints& tile : occupied) index.emplace(tile.key, &tile);

  std::unordered_map<TileKey, CubeMask, TileKeyHash> candidates;
  for (const TilePoints& tile : occupied) {
    candidates.insert_or_assign(tile.key, tile.cubes);
    const Box3 box = occupied_box(tile);
    for_each_neighbour(tile.key, candidate_radius(threshold), [&](const TileKey& neighbour) {
      const Box3 centres = centre_box(neighbour);
      if (centres.exteriorDistance(box) <= threshold) candidates.try_emplace(neighbour);
    });
  }

  std::vector<CandidateTile> plan;
  plan.reserve(candidates.size());
  for (const auto& [key, cubes] : candidates) {
    plan.push_back({key, cubes, surroundings_digest(key, dependence_radius(threshold), index)});
  }
  std::sort(plan.begin(), plan.end(), morton_before);
  return plan;
}

}  // namespace gdfmap
