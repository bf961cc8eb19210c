#pragma once

#include <cstddef>
#include <span>
#include <unordered_map>
#include <vector>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/store/tile_record.hpp>
#include <gdfmap/tiling/point_store.hpp>

namespace gdfmap {

/// The level-0 tile or the tile of a coarser level that holds a level-0 tile.
[[nodiscard]] TileKey ancestor(const TileKey& tile, int level);

/// Box of the marked cubes of a level-0 tile, in cubes from the world's origin.
[[nodiscard]] Box3 box_of_cubes(const TileKey& tile, const CubeMask& cubes);

/// The points of a map by the tiles of one level.
class PointGroups {
 public:
  /// @param occupied  every level-0 tile that holds points; outlives this object
  PointGroups(int level, std::span<const TilePoints> occupied);

  /// The tiles of this level that hold points and are at most `radius` tiles away along each axis,
  /// in key order.
  [[nodiscard]] std::vector<SurroundingTile> around(const TileKey& tile, int radius) const;
  /// Of all points in a tile; zero when there are none.
  [[nodiscard]] Digest digest(const TileKey& tile) const;
  /// The level-0 tiles with points in a tile of this level.
  [[nodiscard]] std::vector<TileKey> occupied_in(const TileKey& tile) const;

 private:
  struct Group {
    Digest digest;
    std::vector<std::size_t> tiles;
  };

  std::span<const TilePoints> occupied_;
  std::unordered_map<TileKey, Group, TileKeyHash> groups_;
};

}  // namespace gdfmap
