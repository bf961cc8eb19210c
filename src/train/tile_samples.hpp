#pragma once

#include <span>
#include <vector>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/edt/sample_lattice.hpp>
#include <gdfmap/train/exact_distance.hpp>

#include "grid_targets.hpp"

namespace gdfmap {

/// Exact distances, in metres, at the samples of some cubes of a tile. They are looked up in
/// chunks, so that several threads can work on one tile.
class TileSamples {
 public:
  /// @param cubes      their indices, ascending
  /// @param populated  which cubes of the tile hold points
  TileSamples(const TileKey& key, std::vector<int> cubes, const CubeMask& populated,
              const Lattice& lattice, ExactDistance& exact_distance);

  [[nodiscard]] const std::vector<int>& cubes() const { return cubes_; }
  /// Whether the cube at place `n` of cubes() holds points.
  [[nodiscard]] bool is_populated(std::size_t n) const { return populated_.test(cubes_[n]); }

  [[nodiscard]] std::size_t num_chunks() const;
  /// Looks up a chunk. Chunks may be looked up in any order and at the same time.
  void look_up(std::size_t chunk);

  /// Once every chunk is looked up, x slowest, z fastest: targets of the cube at place `n` of
  /// cubes(), on the grid of its class.
  [[nodiscard]] std::vector<float> targets(std::size_t n) const;
  void copy_held_out(std::size_t n, std::span<float, kNumHeldOut> held_out) const;

 private:
  [[nodiscard]] GridTargets make_targets(bool populated) const;
  void look_up_held_out(std::size_t cube);
  [[nodiscard]] std::vector<float> distances(std::span<const Eigen::Vector3i> samples) const;

  TileKey key_;
  double step_;  ///< metres
  ExactDistance* exact_distance_;
  std::vector<int> cubes_;
  CubeMask populated_;
  GridTargets populated_targets_, empty_targets_;
  std::vector<float> held_out_;
};

}  // namespace gdfmap
