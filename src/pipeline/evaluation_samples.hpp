#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include <gdfmap/core/cube_mask.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/pipeline/evaluate.hpp>
#include <gdfmap/store/tile_record.hpp>

namespace gdfmap {

/// The level-0 cubes of a field that are judged, tile by tile.
struct JudgedTile {
  TileKey key;
  CubeMask cubes;
  CubeMask populated;    ///< as the trainer saw it; empty for imported cubes
  CubeMask outer_shell;  ///< lack one of their 26 neighbours
};

/// Adds a tile's cubes, without what an export leaves out when `skip_poor`; a tile without any is
/// not added. mark_outer_shell() completes the list.
void add_judged_tile(const TileRecord& record, bool skip_poor, std::vector<JudgedTile>& tiles);
void mark_outer_shell(std::vector<JudgedTile>& tiles);

/// A place where the field is judged.
struct JudgedSample {
  int cube = 0;            ///< index in the tile
  Vector3 p_world;         ///< where the field is asked, metres
  Eigen::Vector3i p_tile;  ///< the same on the quantisation lattice, steps from the tile's corner
};

/// Random samples, uniform over all cubes: a pure function of the seed and the list of cubes, which
/// outlives this object.
class RandomSampler {
 public:
  RandomSampler(const std::vector<JudgedTile>& tiles, std::uint64_t num_samples,
                std::uint64_t seed);
  /// Samples of the tile at this place of the list.
  [[nodiscard]] std::vector<JudgedSample> samples(std::size_t tile, const Lattice& lattice) const;

 private:
  const std::vector<JudgedTile>& tiles_;
  std::uint64_t seed_;
  std::uint64_t num_cubes_ = 0;
  std::vector<std::uint64_t> first_cube_;            ///< of each tile, counted over all
  std::vector<std::vector<std::uint64_t>> of_tile_;  ///< numbers of each tile's samples
};

/// The ancestor's samples: a regular grid of `step` metres in every cube, half a step from its
/// corner.
[[nodiscard]] std::vector<JudgedSample> regular_samples(const JudgedTile& tile, double step,
                                                        const Lattice& lattice);

}  // namespace gdfmap
