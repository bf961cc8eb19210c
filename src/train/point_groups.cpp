#include "point_groups.hpp"

namespace gdfmap {

TileKey ancestor(const TileKey& tile, int level) {
  const auto coordinate = [&](std::int32_t v) {
    return static_cast<std::int32_t>(floor_div(v, level_scale(level)));
  };
  return {level, coordinate(tile.x), coordinate(tile.y), coordinate(tile.z)};
}

Box3 box_of_cubes(const TileKey& tile, const CubeMask& cubes) {
  Box3 box;
  for (int i = 0; i < kCubesPerTile; ++i) {
    if (!cubes.test(i)) continue;
    const CubeKey cube = cube_at(tile, i);
    const Vector3 low(static_cast<double>(cube.x), static_cast<double>(cube.y),
                      static_cast<double>(cube.z));
    box.extend(low).extend(low + Vector3::Ones());
  }
  return box;
}

PointGroups::PointGroups(int level, std::span<const TilePoints> occupied) : occupied_(occupied) {
  for (std::size_t i = 0; i < occupied.size(); ++i) {
    Group& group = groups_[ancestor(occupied[i].key, level)];
    group.digest += occupied[i].digest;
    group.tiles.push_back(i);
  }
}

std::vector<SurroundingTile> PointGroups::around(const TileKey& tile, int radius) const {
  std::vector<SurroundingTile> result;
  for (int x = -radius; x <= radius; ++x) {
    for (int y = -radius; y <= radius; ++y) {
      for (int z = -radius; z <= radius; ++z) {
        const TileKey key{tile.level, tile.x + x, tile.y + y, tile.z + z};
        const auto group = groups_.find(key);
        if (group != groups_.end()) result.push_back({key, group->second.digest});
      }
    }
  }
  return result;
}

Digest PointGroups::digest(const TileKey& tile) const {
  const auto group = groups_.find(tile);
  return group == groups_.end() ? Digest{} : group->second.digest;
}

std::vector<TileKey> PointGroups::occupied_in(const TileKey& tile) const {
  std::vector<TileKey> keys;
  const auto group = groups_.find(tile);
  if (group == groups_.end()) return keys;
  for (const std::size_t i : group->second.tiles) keys.push_back(occupied_[i].key);
  return keys;
}

}  // namespace gdfmap
