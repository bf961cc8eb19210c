#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <gdfmap/core/cube_mask.hpp>
#include <gdfmap/core/lattice.hpp>

#include "grid_targets.hpp"
#include "held_out_targets.hpp"

namespace gdfmap {

/// Exact distances, in metres, at the samples of some cubes of a tile. They come in chunks, so that
/// several threads can work on one tile.
class TileSamples {
 public:
  /// @param cubes      their indices, ascending
  /// @param populated  which cubes of the tile hold points
  TileSamples(const TileKey& key, std::vector<int> cubes, const CubeMask& populated,
              const Lattice& lattice);

  [[nodiscard]] const std::vector<int>& cubes() const { return cubes_; }
  /// Whether the cube at place `n` of cubes() holds points.
  [[nodiscard]] bool is_populated(std::size_t n) const { return populated_.test(cubes_[n]); }

  [[nodiscard]] std::size_t num_chunks() const;
  [[nodiscard]] const TileKey& tile() const { return key_; }
  /// The samples of a chunk in packets, in quantisation steps from the tile's minimum.
  [[nodiscard]] std::vector<Eigen::Vector3i> samples(std::size_t chunk) const;
  /// Takes the distances at them, in steps. Several chunks may be kept at the same time.
  void keep(std::size_t chunk, std::span<const double> distances);

  /// Once every chunk is kept, x slowest, z fastest: those of the cube at place `n` of cubes(), on
  /// the grid of its class.
  [[nodiscard]] std::vector<float> targets(std::size_t n) const;
  [[nodiscard]] std::vector<float> held_out(std::size_t n) const;

 private:
  /// Of the cubes of one class.
  struct Class {
    GridTargets targets;
    HeldOutTargets held_out;
  };
  [[nodiscard]] Class make_class(bool populated) const;
  [[nodiscard]] const Class& class_of(std::size_t n) const { return classes_[is_populated(n)]; }
  /// visit(part, chunk of it) for the part that holds a chunk.
  template <typename Classes, typename Visit>
  static auto visit_chunk(Classes& classes, std::size_t chunk, const Visit& visit);

  TileKey key_;
  double step_;  ///< metres
  std::vector<int> cubes_;
  CubeMask populated_;
  std::array<Class, 2> classes_;  ///< empty, populated
};

}  // namespace gdfmap
