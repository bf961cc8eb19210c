#pragma once

#include <vector>

#include <gdfmap/core/cube_mask.hpp>
#include <gdfmap/edt/sample_lattice.hpp>
#include <gdfmap/fit/fit_config.hpp>
#include <gdfmap/train/exact_distance.hpp>

namespace gdfmap {

/// Exact distances, in metres, at the samples of every cube of a tile that is to be fitted.
class TileSamples {
 public:
  /// Selects the cubes that hold points or whose centre is within the threshold of one, and looks
  /// up their targets; samples that neighbours share are looked up once.
  TileSamples(const TileKey& key, const CubeMask& populated, const Lattice& lattice,
              const FitConfig& config, ExactDistance& exact_distance, int num_threads);

  /// Indices of the selected cubes, ascending.
  [[nodiscard]] const std::vector<int>& cubes() const { return cubes_; }

  /// Targets of the cube at place `n` of cubes(), x slowest, z fastest.
  void copy_targets(std::size_t n, std::span<float, kNumSamples> targets) const;
  [[nodiscard]] std::span<const float, kNumHeldOut> held_out(std::size_t n) const {
    return std::span<const float, kNumHeldOut>(held_out_.data() + n * kNumHeldOut, kNumHeldOut);
  }

 private:
  void select_cubes(const CubeMask& populated, double threshold);
  void look_up_targets();
  void look_up_held_out();
  [[nodiscard]] std::vector<float> distances(std::span<const Eigen::Vector3i> samples) const;

  TileKey key_;
  double step_;  ///< metres
  ExactDistance* exact_distance_;
  int num_threads_;
  std::vector<int> cubes_;
  std::vector<float> targets_;  ///< on the tile's sample lattice; unset where no cube needs it
  std::vector<float> held_out_;
};

}  // namespace gdfmap
