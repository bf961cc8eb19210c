#pragma once

#include <array>
#include <span>
#include <vector>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/edt/sample_lattice.hpp>
#include <gdfmap/train/exact_distance.hpp>

namespace gdfmap {

/// Exact distances, in metres, at the samples of some cubes of a tile. They are looked up in
/// chunks, so that several threads can work on one tile.
class TileSamples {
 public:
  /// @param cubes  their indices, ascending
  TileSamples(const TileKey& key, std::vector<int> cubes, const Lattice& lattice,
              ExactDistance& exact_distance);

  [[nodiscard]] const std::vector<int>& cubes() const { return cubes_; }

  [[nodiscard]] std::size_t num_chunks() const { return num_target_chunks() + cubes_.size(); }
  /// Looks up a chunk; samples that neighbouring cubes share are in one chunk only. Chunks may be
  /// looked up in any order and at the same time.
  void look_up(std::size_t chunk);

  /// Once every chunk is looked up: targets of the cube at place `n` of cubes(), x slowest, z
  /// fastest.
  void copy_targets(std::size_t n, std::span<float, kNumSamples> targets) const;
  void copy_held_out(std::size_t n, std::span<float, kNumHeldOut> held_out) const;

 private:
  [[nodiscard]] std::size_t num_target_chunks() const;
  void select_packets();
  void look_up_targets(std::size_t chunk);
  void look_up_held_out(std::size_t cube);
  [[nodiscard]] std::vector<float> distances(std::span<const Eigen::Vector3i> samples) const;

  TileKey key_;
  double step_;  ///< metres
  ExactDistance* exact_distance_;
  std::vector<int> cubes_;
  std::vector<std::array<int, 3>> packets_;  ///< of the sample lattice, that some cube needs
  std::vector<int> slots_;      ///< of every packet of the lattice among packets_; or −1
  std::vector<float> targets_;  ///< packet by packet, x slowest
  std::vector<float> held_out_;
};

}  // namespace gdfmap
