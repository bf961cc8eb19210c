#pragma once

#include <span>
#include <vector>

#include "point_evaluator.hpp"

namespace gdfmap::surface {

/// A place that was moved onto the surface.
struct ProjectedPoint {
  Vector3 position = Vector3::Zero();  ///< world frame, metres
  /// Unit vector away from the surface, on the side that the place came from; zero where the field
  /// has no gradient.
  Vector3 normal = Vector3::Zero();
  double distance = 0.0;        ///< that the field states at `position`, metres
  double expected_error = 0.0;  ///< of the cubes there, metres; NaN where unknown
  /// False where the field shows no surface: the place was moved by the distance that the field
  /// stated, and is a guess.
  bool is_on_surface = false;
};

/// Moves points onto the surface. There an unsigned field is a valley whose floor the fit rounds
/// off, and between the two sides of a thin wall no valley at all, but a little away it is as steep
/// as a distance is. A point therefore walks, by Newton's steps, to where the distance is one of a
/// few small offsets, the least at which the field is steep there; its surface is back by that
/// distance along the gradient. The other side of the surface is asked the same, and where both
/// answers are near each other their mean is taken, because they err in opposite directions. What
/// becomes of a point depends on it alone. Not thread-safe; used again for other points.
class Projector {
 public:
  /// Points that are best projected at a time: enough to fill vectors, few enough for little
  /// memory.
  static constexpr std::size_t kBatch = 4096;

  explicit Projector(const FieldOnGrid& field) : edge_(field.zones.edge()), evaluator_(field) {}

  /// Valid until the next call.
  [[nodiscard]] std::span<const ProjectedPoint> project(std::span<const Vector3> points_world);
  /// What the field says of places that stay where they are. Valid until the next call.
  [[nodiscard]] std::span<const ProjectedPoint> describe(std::span<const Vector3> points_world);

 private:
  /// A point on its way to an offset.
  struct Walker {
    std::size_t point;  ///< whose it is
    Vector3 from;       ///< its surface is looked for near this place
    Vector3 position;
    FieldValue value = {};
    double reach = 0.0;  ///< how near, metres

    /// Where the surface would be.
    [[nodiscard]] Vector3 foot() const;
    [[nodiscard]] ProjectedPoint projected(bool is_on_surface) const;
    /// Whether it is at its offset, and the field is to be believed there.
    [[nodiscard]] bool has_arrived(double offset) const;
  };
  using Walkers = std::vector<Walker>;

  void evaluate(Walkers& walkers);
  void walk(Walkers& walkers, double offset);
  void find_near_sides(std::span<const Vector3> points_world);
  void ask_far_sides();
  void describe_places();

  double edge_;
  PointEvaluator evaluator_;
  std::vector<Vector3> positions_;
  std::vector<FieldValue> values_;
  std::vector<ProjectedPoint> projected_;
};

}  // namespace gdfmap::surface
