#pragma once

#include <span>
#include <vector>

#include "point_evaluator.hpp"

namespace gdfmap::surface {

/// A place that was moved onto the surface.
struct ProjectedPoint {
  Vector3 position;  ///< world frame, metres
  /// Unit vector along the field's gradient at the place it came from, away from the surface on
  /// that side; zero where the field has none.
  Vector3 normal;
  double distance;        ///< that the field states at `position`, metres
  double expected_error;  ///< of the cubes there, metres; NaN where unknown
};

/// Moves points onto the surface by steps −d·∇d / max(1, |∇d|²). Where |∇d| ≥ 1 that is Newton's
/// step to d = 0. At the surface itself an unsigned field has a valley with a rounded floor,
/// where ∇d vanishes and Newton's step would jump: there it is the step of ½∇(d²) = d·∇d, which
/// for d² = x² + r² ends on the floor at once. A step that does not lower |d| is not taken. Not
/// thread-safe; used again for other points.
class Projector {
 public:
  explicit Projector(const FieldOnGrid& field) : evaluator_(field) {}

  /// Valid until the next call.
  [[nodiscard]] std::span<const ProjectedPoint> project(std::span<const Vector3> points_world);

 private:
  static constexpr int kSteps = 3;

  PointEvaluator evaluator_;
  std::vector<FieldValue> values_, new_values_;
  std::vector<Vector3> moved_;
  std::vector<ProjectedPoint> projected_;
};

}  // namespace gdfmap::surface
