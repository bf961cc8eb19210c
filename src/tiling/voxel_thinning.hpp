#pragma once

#include <vector>

#include <gdfmap/tiling/block_codec.hpp>

namespace gdfmap {

/// Keeps one point of every voxel, in place: the one nearest to the voxel's centre, of equally near
/// ones the first in Morton order. Thinning a union of sets is therefore the same as thinning each
/// and then their union. Voxels are counted from the minimum corner of each cube and cut at its
/// faces, so that no cube loses its last point and a tile is thinned without its neighbours.
/// @param points       of one tile, as sort_unique leaves them
/// @param voxel_steps  edge of a voxel in quantisation steps, 1 to kStepsPerCubeAxis; 0: keep all
void thin(std::vector<TileOffset>& points, int voxel_steps);

}  // namespace gdfmap
