#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <gdfmap/field/blending.hpp>

#include "neighbourhood.hpp"
#include "surface_domain.hpp"

namespace gdfmap::surface {

/// What is fixed for a whole surface.
struct FieldOnGrid {
  const SurfaceDomain& domain;
  TileCache& tiles;
  BlendZones zones;
  double max_mae;  ///< metres: cubes with a greater error give no samples of their own
  const SurfaceKernels& kernels;
};

/// The field at the samples of a block, from level-0 cubes alone: the separable partition of unity,
/// normalised where cubes are missing, so that a model's last cube is used up to its face. A value
/// depends on its place alone, not on the block it is asked for with: to the last bit, so that
/// blocks agree where they meet. Not thread-safe; used again for the next block.
class BlockSampler {
 public:
  /// Largest blocks, in samples along an axis.
  static constexpr std::int64_t kMaxSide = 64;
  /// The value of a sample outside the domain, or of a cube that gives none.
  static constexpr float kOutside = std::numeric_limits<float>::infinity();

  enum class Wanted { kValues, kValuesAndErrors };
  explicit BlockSampler(const FieldOnGrid& field, Wanted wanted = Wanted::kValues)
      : field_(field), wanted_(wanted) {}

  /// Samples `box`, at most kMaxSide + 1 along an axis. Returns how many are in the domain.
  std::size_t sample(const SampleBox& box);

  [[nodiscard]] const SampleBox& box() const { return box_; }
  /// Of the last sample(): the values of a row along x.
  [[nodiscard]] const float* row(std::size_t y, std::size_t z) const {
    return values_.data() + z * plane() + y * row_stride_;
  }
  /// Likewise the mean absolute errors that cubes state, blended as values are, metres; those that
  /// are not known count as none. Only where they are wanted.
  [[nodiscard]] const float* errors(std::size_t y, std::size_t z) const {
    return errors_.data() + z * plane() + y * row_stride_;
  }
  /// Cubes in the domain that the block passed over for their error.
  [[nodiscard]] const std::vector<CubeKey>& poor_cubes() const { return poor_cubes_; }

 private:
  /// The samples of the block along one axis.
  struct Axis {
    std::vector<std::int64_t> cubes;  ///< that hold them
    std::vector<AxisBlend<double>> blends;
    std::vector<std::int64_t> first_cubes;  ///< of the blends
    std::int64_t low = 0, high = 0;         ///< cubes that share them, both included
  };
  /// A cube's samples along one axis.
  struct Share {
    AlignedFloats position;  ///< from the cube's lower face, metres
    AlignedFloats share;     ///< zero where it has none
    std::size_t begin = 0, end = 0;
  };

  [[nodiscard]] std::size_t plane() const { return row_stride_ * box_.size(1); }
  void prepare(const SampleBox& box);
  [[nodiscard]] std::vector<SampleBox> domain_parts(const Neighbourhood& cubes);
  void add_cube(const CubeKey& key, const Neighbourhood::Cube* cube);
  [[nodiscard]] bool find_shares(const CubeKey& key);
  void add_gaussians(const GaussianRows& rows);
  /// Adds the cube's share of each sample, `factor` times.
  void add_shares(float factor, std::vector<float>& sums) const;
  void normalise();
  void keep(const std::vector<SampleBox>& parts);

  const FieldOnGrid& field_;
  Wanted wanted_;
  SampleBox box_;
  std::size_t row_stride_ = 0;
  std::array<Axis, 3> axes_;
  std::array<Share, 3> shares_;
  GaussianRowsBuffer rows_;
  std::array<AlignedFloats, 3> factors_;
  AlignedFloats products_;
  AlignedFloats values_;
  bool is_complete_ = true;     ///< no cube that shares a sample is missing
  std::vector<float> missing_;  ///< share of missing cubes, laid out as values_
  std::vector<float> errors_;   ///< likewise
  std::vector<CubeKey> poor_cubes_;
};

}  // namespace gdfmap::surface
