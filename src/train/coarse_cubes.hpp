#pragma once

#include <span>
#include <unordered_map>

#include <gdfmap/core/cube_mask.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/tiling/point_store.hpp>

namespace gdfmap {

/// A cube of level n ≥ 1 is fitted when its margin box is this near, in its edges, to an occupied
/// level-0 cube: wherever a point is that near, the weights of the level then sum to 1.
inline constexpr int kCoarseReach = 2;

using TileMasks = std::unordered_map<TileKey, CubeMask, TileKeyHash>;

/// The cubes of a coarse tile.
struct CoarseCubes {
  CubeMask populated;  ///< hold points
  CubeMask wanted;     ///< are to be fitted
};

/// The cubes of level n ≥ 1 that are to be fitted. One that lies, with its margin, where the
/// weights of the finer level sum to 1 could never be seen and is left out.
/// @param occupied      every level-0 tile that holds points
/// @param finer_served  the cubes of level n − 1 that have Gaussians
[[nodiscard]] std::unordered_map<TileKey, CoarseCubes, TileKeyHash> coarse_cubes(
    int level, std::span<const TilePoints> occupied, const TileMasks& finer_served);

}  // namespace gdfmap
