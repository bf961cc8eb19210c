#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/field/blending.hpp>

#include "block_sampler.hpp"

namespace gdfmap::surface {

/// The field at a point; all not-a-number where no cube shares it.
struct FieldValue {
  double distance = 0.0;               ///< metres
  Vector3 gradient = Vector3::Zero();  ///< world frame, no unit
  double expected_error =
      0.0;  ///< mean of the cubes' as they contribute, metres; NaN where unknown
};

/// The field of BlockSampler, with gradient, at points that lie near each other: cube by cube, with
/// the points in the lanes of the kernels. A value depends on its place alone. Not thread-safe;
/// used again for other points.
class PointEvaluator {
 public:
  explicit PointEvaluator(const FieldOnGrid& field) : field_(field) {}

  /// values[i] answers points_world[i]. Holds the tiles of the points' bounding box meanwhile.
  void evaluate(std::span<const Vector3> points_world, std::span<FieldValue> values);

 private:
  /// A cube's part in one point.
  struct Visit {
    std::size_t point;
    CubeKey cube;
    Vector3 p_local;
    double weight;
    Vector3 weight_gradient;
  };
  /// Σ w and ∇Σ w of a point.
  struct Share {
    double weight = 0.0;
    Vector3 gradient = Vector3::Zero();
  };

  void collect_visits(std::span<const Vector3> points_world);
  void collect_visits(std::size_t point, const Vector3& p_world, const BlendZone& zone);
  void sort_visits(const Neighbourhood& cubes);
  [[nodiscard]] std::span<const std::uint32_t> visits_of(std::size_t cube) const;
  void evaluate_cube(const Neighbourhood::Cube& cube, std::span<const std::uint32_t> visits);
  void add(const Visit& visit, std::size_t place, double mae, FieldValue& sum);

  const FieldOnGrid& field_;
  CubeKey low_, high_;
  std::vector<Visit> visits_;         ///< point by point
  std::vector<std::uint32_t> order_;  ///< of the visits, cube by cube
  std::vector<std::uint32_t> ends_;   ///< of each cube's visits in that order
  std::vector<Share> shares_;
  GaussianRowsBuffer rows_;
  std::array<AlignedFloats, 3> position_, gradient_;
  AlignedFloats value_;
};

}  // namespace gdfmap::surface
