#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/store/tile_record.hpp>
#include <gdfmap/tiling/point_store.hpp>

#include "point_groups.hpp"

namespace gdfmap {

/// Where the points of today differ from those that stored tiles were trained from. Scans that were
/// added since are told by the cubes that they touch; of a tile that changed in any other way
/// nothing more is known.
class PointChanges {
 public:
  /// Both outlive this object.
  PointChanges(PointStore& store, const PointGroups& groups) : store_(store), groups_(groups) {}

  /// Boxes, in level-0 cubes from the world's origin, that hold every point which came or went.
  /// @param former  what the tile was trained from  @param today  what it would be trained from now
  [[nodiscard]] std::vector<Box3> since(std::span<const SurroundingTile> former,
                                        std::span<const SurroundingTile> today);

 private:
  struct Change {
    Digest former;
    std::vector<Box3> boxes;
  };

  const std::vector<Box3>& change_of(const TileKey& tile, const Digest& former);
  [[nodiscard]] std::vector<Box3> find_change(const TileKey& tile, const Digest& former);

  PointStore& store_;
  const PointGroups& groups_;
  /// The last one of each tile: its neighbours mostly saw the same.
  std::unordered_map<TileKey, Change, TileKeyHash> known_;
};

}  // namespace gdfmap
