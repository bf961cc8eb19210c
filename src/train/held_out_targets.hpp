#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <gdfmap/edt/sample_lattice.hpp>

namespace gdfmap {

/// Exact distances, in metres, at the held-out samples of those cubes of a tile that have the same
/// grid. They are looked up in chunks, like GridTargets.
class HeldOutTargets {
 public:
  /// @param cubes  their indices, ascending
  HeldOutTargets(const TrainingGrid& grid, int level, std::vector<int> cubes);

  [[nodiscard]] std::size_t num_chunks() const;
  /// The samples of a chunk in packets, in quantisation steps from the tile's minimum.
  [[nodiscard]] std::vector<Eigen::Vector3i> samples(std::size_t chunk) const;
  /// Takes the distances at them, in metres. Several chunks may be kept at the same time.
  void keep(std::size_t chunk, std::span<const float> distances);
  /// Those of a cube, x slowest, z fastest, once every chunk is kept.
  [[nodiscard]] std::vector<float> of_cube(int cube) const;

 private:
  [[nodiscard]] std::size_t cubes_per_chunk() const;
  [[nodiscard]] std::span<const int> cubes_of(std::size_t chunk) const;

  TrainingGrid grid_;
  int level_;
  std::vector<int> cubes_;
  std::vector<float> targets_;  ///< cube by cube, x slowest
};

}  // namespace gdfmap
