#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include <gdfmap/store/cube_store.hpp>
#include <gdfmap/tiling/point_store.hpp>

#include "tile_plan.hpp"

namespace gdfmap {

/// Every tile that holds points, in key order.
[[nodiscard]] std::vector<TilePoints> occupied_tiles(PointStore& points);

/// What is known of the stored tiles of a level without reading their cubes.
using TileStates = std::unordered_map<TileKey, TileState, TileKeyHash>;
[[nodiscard]] TileStates stored_states(CubeStore& cubes, int level);

/// What the stored tiles of a level lack to be those of today.
struct StaleTiles {
  std::vector<CandidateTile> stale;  ///< to be trained, in the order of the plan
  std::vector<TileKey> obsolete;     ///< no candidates any more, in no order
};
[[nodiscard]] StaleTiles find_stale(std::span<const CandidateTile> plan, TileStates stored,
                                    const Digest& configuration);

}  // namespace gdfmap
