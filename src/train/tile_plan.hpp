#pragma once

#include <memory>
#include <span>
#include <vector>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/fit/fit_config.hpp>
#include <gdfmap/tiling/point_store.hpp>

#include "coarse_cubes.hpp"
#include "point_groups.hpp"

namespace gdfmap {

/// A tile that may have cubes, and what they depend on.
struct CandidateTile {
  TileKey key;
  CubeMask populated;  ///< its cubes that hold points
  /// Level 1 and up: the cubes to fit. At level 0 the exact distance of their centres decides.
  CubeMask wanted;
  Digest surroundings;  ///< see surroundings_digest()
};

/// The candidates of one level, in Morton order, so that neighbours in space are trained one after
/// the other.
class TilePlan {
 public:
  /// @param occupied      every level-0 tile that holds points; outlives this object
  /// @param finer_served  see coarse_cubes(); of no meaning at level 0
  TilePlan(int level, std::span<const TilePoints> occupied, const Lattice& lattice,
           const FitConfig& config, const TileMasks& finer_served);

  [[nodiscard]] const std::vector<CandidateTile>& tiles() const { return tiles_; }
  [[nodiscard]] const PointGroups& groups() const { return groups_; }
  /// Every tile whose points a tile's cubes can depend on.
  [[nodiscard]] std::vector<SurroundingTile> surroundings(const TileKey& tile) const {
    return groups_.around(tile, dependence_radius_);
  }

 private:
  PointGroups groups_;
  int dependence_radius_;  // tiles
  std::vector<CandidateTile> tiles_;
};

}  // namespace gdfmap
