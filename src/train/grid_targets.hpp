#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <gdfmap/edt/sample_lattice.hpp>

namespace gdfmap {

/// Exact distances, in metres, at the training samples of those cubes of a tile that have the same
/// grid. They are looked up in chunks; samples that neighbouring cubes share are in one chunk only.
class GridTargets {
 public:
  /// @param cubes  their indices
  GridTargets(const TrainingGrid& grid, int level, std::span<const int> cubes);

  [[nodiscard]] std::size_t num_chunks() const;
  /// The samples of a chunk in packets, in quantisation steps from the tile's minimum.
  [[nodiscard]] std::vector<Eigen::Vector3i> samples(std::size_t chunk) const;
  /// Takes the distances at them, in metres. Several chunks may be kept at the same time.
  void keep(std::size_t chunk, std::span<const float> distances);
  /// Targets of a cube, x slowest, z fastest, once every chunk is kept.
  [[nodiscard]] std::vector<float> of_cube(int cube) const;

 private:
  [[nodiscard]] std::span<const std::array<int, 3>> packets_of(std::size_t chunk) const;
  void select_packets(std::span<const int> cubes);
  [[nodiscard]] std::size_t packet_index(int x, int y, int z) const;

  TrainingGrid grid_;
  std::vector<int> offsets_;  ///< of the tile's samples along an axis, in steps from its minimum
  std::vector<std::array<int, 3>> packets_;  ///< of the tile's samples, that some cube needs
  std::vector<int> slots_;      ///< of every packet of the tile among packets_; or −1
  std::vector<float> targets_;  ///< packet by packet, x slowest
};

}  // namespace gdfmap
