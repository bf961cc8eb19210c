#pragma once

#include <span>
#include <vector>

#include "point_evaluator.hpp"

namespace gdfmap::surface {

/// A place that was moved onto the surface.
struct ProjectedPoint {
  Vector3 position = Vector3::Zero();  ///< world frame, metres
  /// Unit vector along the field's gradient at the place it came from, away from the surface on
  /// that side; zero where the field has none.
  Vector3 normal = Vector3::Zero();
  double distance = 0.0;        ///< that the field states at `position`, metres
  double expected_error = 0.0;  ///< of the cubes there, metres; NaN where unknown
};

/// Moves points onto the surface by steps −d·∇d / max(1, |∇d|²). Where |∇d| ≥ 1 that is Newton's
/// step to d = 0. At the surface itself an unsigned field has a valley with a rounded floor,
/// where ∇d vanishes and Newton's step would jump: there it is the step of ½∇(d²) = d·∇d, which
/// for d² = x² + r² ends on the floor at once. A step that does not lower |d| is not taken. Not
/// thread-safe; used again for other points.
class Projector {
 public:
  static constexpr int kSteps = 3;
  /// Points that are best projected at a time: enough to fill vectors, few enough for little
  /// memory.
  static constexpr std::size_t kBatch = 4096;

  explicit Projector(const FieldOnGrid& field) : evaluator_(field) {}

  /// Valid until the next call. @param num_steps  0 leaves the points where they are
  [[nodiscard]] std::span<const ProjectedPoint> project(std::span<const Vector3> points_world,
                                                        int num_steps = kSteps);

 private:
  PointEvaluator evaluator_;
  std::vector<FieldValue> values_, new_values_;
  std::vector<Vector3> moved_;
  std::vector<ProjectedPoint> projected_;
};

}  // namespace gdfmap::surface
