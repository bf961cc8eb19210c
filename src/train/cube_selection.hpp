#pragma once

#include <optional>
#include <span>
#include <vector>

#include <gdfmap/fit/fit_config.hpp>
#include <gdfmap/store/tile_record.hpp>
#include <gdfmap/train/exact_distance.hpp>

#include "tile_plan.hpp"

namespace gdfmap {

/// The cubes of a tile: those that stay as they are, and those whose inputs may have changed.
struct CubeSelection {
  std::vector<int> kept;       ///< indices of stored cubes, ascending
  std::vector<int> looked_up;  ///< indices, ascending
};

/// Decides which cubes of a tile are to be fitted and which of them no change can have reached: no
/// point that came or went is nearer to them than the farthest target of theirs.
/// @param stored   the tile's former cubes, by index
/// @param changes  see PointChanges; empty when nothing stored counts any more
[[nodiscard]] CubeSelection select_cubes(const CandidateTile& tile,
                                         std::span<const CubeRecord> stored,
                                         const std::optional<std::vector<Box3>>& changes,
                                         const Lattice& lattice, const FitConfig& config,
                                         ExactDistance& exact_distance);

}  // namespace gdfmap
