#pragma once

#include <optional>
#include <span>
#include <vector>

#include <gdfmap/fit/fit_config.hpp>
#include <gdfmap/store/tile_record.hpp>
#include <gdfmap/train/exact_distance.hpp>

#include "tile_plan.hpp"

namespace gdfmap {

/// What was known of a tile before.
struct FormerTile {
  std::vector<CubeRecord> cubes;  ///< of the configuration of today, by index
  std::vector<Box3> changes;      ///< see PointChanges
};

/// The cubes of a tile: those that stay as they are, and those whose inputs may have changed.
struct CubeSelection {
  std::vector<CubeRecord> kept;
  std::vector<int> looked_up;  ///< indices, ascending
};

/// Decides which cubes of a tile are to be fitted and which of them no change can have reached: no
/// point that came or went is nearer to them than the farthest target of theirs.
/// @param former  empty when nothing is known that still counts
[[nodiscard]] CubeSelection select_cubes(const CandidateTile& tile,
                                         std::optional<FormerTile> former, const Lattice& lattice,
                                         const FitConfig& config, ExactDistance& exact_distance);

}  // namespace gdfmap
