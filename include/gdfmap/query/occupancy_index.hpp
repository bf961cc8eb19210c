#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <gdfmap/core/cube_mask.hpp>
#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/lattice.hpp>

namespace gdfmap {

/// Distance to the nearest occupied cube: never more than the distance to the nearest point.
struct FarBound {
  double distance = 0.0;               ///< metres, 0 inside a cube
  Vector3 gradient = Vector3::Zero();  ///< unit vector away from the cube; zero inside
};

/// Finds the nearest occupied level-0 cube, exactly and from anywhere: tiles in Morton order under
/// a tree of bounding boxes, cubes of a tile by its mask. Memory grows with the number of tiles,
/// whatever the distances between them. Immutable and thread-safe.
class OccupancyIndex {
 public:
  /// @param tiles  level 0, each once, in any order; tiles without an occupied cube are left out
  OccupancyIndex(std::vector<OccupiedTile> tiles, double cube_size);

  [[nodiscard]] bool empty() const { return tiles_.empty(); }
  /// The occupied cubes of a level-0 tile; null where there is none.
  [[nodiscard]] const CubeMask* find(const TileKey& tile) const;
  /// Empty when no cube is occupied. @param p_world  finite
  [[nodiscard]] std::optional<FarBound> nearest(const Vector3& p_world) const;

 private:
  /// Smallest and largest tile coordinates of a group of tiles.
  struct Bounds {
    std::int32_t low[3];
    std::int32_t high[3];
  };
  class Search;

  std::vector<OccupiedTile> tiles_;
  /// From fine to coarse: node i of layers_[0] covers tiles [8i, 8i + 8), node i of layers_[n] the
  /// nodes [8i, 8i + 8) of layers_[n − 1]; the last layer has one node.
  std::vector<std::vector<Bounds>> layers_;
  double cube_size_;
};

}  // namespace gdfmap
