#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <gdfmap/edt/sample_lattice.hpp>

namespace gdfmap {

/// Exact distances, in metres, at the training samples of those cubes of a tile that have the same
/// grid. They are looked up in chunks; samples that neighbouring cubes share are in one chunk only.
class GridTargets {
 public:
  /// Distances in metres at samples in quantisation steps from the tile's minimum, which come in
  /// packets.
  using Distances = std::function<std::vector<float>(std::span<const Eigen::Vector3i>)>;

  /// @param cubes  their indices
  GridTargets(const TrainingGrid& grid, int level, std::span<const int> cubes);

  [[nodiscard]] std::size_t num_chunks() const;
  /// Chunks may be looked up in any order and at the same time.
  void look_up(std::size_t chunk, const Distances& distances);
  /// Targets of a cube, x slowest, z fastest, once every chunk is looked up.
  [[nodiscard]] std::vector<float> of_cube(int cube) const;

 private:
  void select_packets(std::span<const int> cubes);
  [[nodiscard]] std::size_t packet_index(int x, int y, int z) const;

  TrainingGrid grid_;
  int level_;
  std::vector<std::array<int, 3>> packets_;  ///< of the tile's samples, that some cube needs
  std::vector<int> slots_;      ///< of every packet of the tile among packets_; or −1
  std::vector<float> targets_;  ///< packet by packet, x slowest
};

}  // namespace gdfmap
