#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/fit/fit_config.hpp>
#include <gdfmap/tiling/point_store.hpp>

namespace gdfmap {

/// A tile that may have level-0 cubes, and what its cubes depend on.
struct CandidateTile {
  TileKey key;
  CubeMask cubes;       ///< which of its cubes hold points
  Digest surroundings;  ///< of every tile whose points its cubes can depend on
};

/// The occupied tiles and those near enough to have empty cubes to fit, in Morton order, so that
/// neighbours in space are trained one after the other.
[[nodiscard]] std::vector<CandidateTile> plan_tiles(std::span<const TilePoints> occupied,
                                                    const Lattice& lattice,
                                                    const FitConfig& config);

}  // namespace gdfmap
