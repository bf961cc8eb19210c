#include "surface_domain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include <gdfmap/core/morton.hpp>

namespace gdfmap::surface {
namespace {

SampleBox samples_of_region(const std::optional<Box3>& region, const SampleGrid& grid) {
  SampleBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    // Coordinates of cubes, and so of samples, stay far within 2⁶².
    constexpr std::int64_t kEverywhere = std::numeric_limits<std::int64_t>::max() / 2;
    box.begin[axis] = region ? grid.first_from(region->min()[a]) : -kEverywhere;
    box.end[axis] = region ? grid.first_from(region->max()[a]) : kEverywhere;
  }
  return box;
}

/// The cubes next to a cube and itself, by the offset along each axis.
template <typename Visit>
void for_each_neighbour(const CubeKey& cube, const Visit& visit) {
  for (int dx = -1; dx <= 1; ++dx) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dz = -1; dz <= 1; ++dz) {
        visit(CubeKey{cube.level, cube.x + dx, cube.y + dy, cube.z + dz}, std::array{dx, dy, dz});
      }
    }
  }
}

}  // namespace

SurfaceDomain::SurfaceDomain(TileSource& source, const SampleGrid& grid, double reach,
                             const std::optional<Box3>& region)
    : grid_(grid),
      lattice_(source.geometry().cube_size),
      reach_(reach),
      region_(samples_of_region(region, grid)) {
  for (const OccupiedTile& tile : source.occupied()) occupied_.emplace(tile.key, tile.cubes);
  tiles_ = find_tiles();
}

bool SurfaceDomain::is_occupied(const CubeKey& cube) const {
  const auto tile = occupied_.find(tile_of(cube));
  return tile != occupied_.end() && tile->second.test(cube_index_in_tile(cube));
}

bool SurfaceDomain::has_samples(const TileKey& tile) const {
  const CubeKey low = cube_at(tile, 0), high = cube_at(tile, kCubesPerTile - 1);
  const SampleBox box = {
      {grid_.first_in_cube(low.x), grid_.first_in_cube(low.y), grid_.first_in_cube(low.z)},
      {grid_.first_in_cube(high.x + 1), grid_.first_in_cube(high.y + 1),
       grid_.first_in_cube(high.z + 1)}};
  return box.intersection(region_).count() > 0;
}

std::vector<TileKey> SurfaceDomain::find_tiles() const {
  std::unordered_set<TileKey, TileKeyHash> found;
  for (const auto& [key, mask] : occupied_) {
    for (int index = 0; index < kCubesPerTile; ++index) {
      if (!mask.test(index)) continue;
      for_each_neighbour(cube_at(key, index), [&](const CubeKey& cube, const auto&) {
        const TileKey tile = tile_of(cube);
        if (!found.contains(tile) && has_samples(tile) && samples_in(cube).count() > 0) {
          found.insert(tile);
        }
      });
    }
  }
  std::vector<TileKey> tiles(found.begin(), found.end());
  std::ranges::sort(tiles, in_morton_order<TileKey>);
  return tiles;
}

SampleBox SurfaceDomain::all_samples_in(const CubeKey& cube) const {
  return {{grid_.first_in_cube(cube.x), grid_.first_in_cube(cube.y), grid_.first_in_cube(cube.z)},
          {grid_.first_in_cube(cube.x + 1), grid_.first_in_cube(cube.y + 1),
           grid_.first_in_cube(cube.z + 1)}};
}

SampleBox SurfaceDomain::samples_in(const CubeKey& cube) const {
  const std::array<std::int64_t, 3> own = {cube.x, cube.y, cube.z};
  // The hull of what the occupied cubes around it reach.
  SampleBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.begin[axis] = std::numeric_limits<std::int64_t>::max();
    box.end[axis] = std::numeric_limits<std::int64_t>::min();
  }
  for_each_neighbour(cube, [&](const CubeKey& neighbour, const std::array<int, 3>& offset) {
    if (!is_occupied(neighbour)) return;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t first = grid_.first_in_cube(own[axis]);
      const std::int64_t last = grid_.first_in_cube(own[axis] + 1);
      const double low = static_cast<double>(own[axis]) * lattice_.cube_size();
      const double high = static_cast<double>(own[axis] + 1) * lattice_.cube_size();
      const bool from_high = offset[axis] > 0, from_low = offset[axis] < 0;
      box.begin[axis] =
          std::min(box.begin[axis], from_high ? grid_.first_from(high - reach_) : first);
      box.end[axis] =
          std::max(box.end[axis], from_low ? std::min(last, grid_.first_from(low + reach_)) : last);
    }
  });
  return box.intersection(region_);
}

const std::array<int, kCubesPerTile>& morton_order_of_cubes() {
  static const auto order = [] {
    std::array<int, kCubesPerTile> cubes;
    for (std::size_t code = 0; code < cubes.size(); ++code) {
      const auto axis = [&](int a) { return static_cast<int>(gather_bits(code >> a)); };
      cubes[code] = cube_index(axis(0), axis(1), axis(2));
    }
    return cubes;
  }();
  return order;
}

}  // namespace gdfmap::surface
