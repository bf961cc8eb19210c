#pragma once

#include <vector>

#include "hash_stream.hpp"
#include "patch.hpp"

namespace gdfmap::synthetic {

/// Where an object stands: its base point and its rotation about z. Lengths in metres.
struct Pose {
  Vector3 position = Vector3::Zero();
  double cosine = 1.0, sine = 0.0;

  [[nodiscard]] Vector3 axis_x() const { return {cosine, sine, 0.0}; }
  [[nodiscard]] Vector3 axis_y() const { return {-sine, cosine, 0.0}; }
  /// The same orientation at a place given in this pose's own axes.
  [[nodiscard]] Pose at(double x, double y, double z) const;
  /// Turned by a further quarter turn.
  [[nodiscard]] Pose quarter_turned() const { return {position, -sine, cosine}; }
  /// Turned by an angle whose half has this tangent: rational, so that it is exact everywhere.
  [[nodiscard]] Pose turned(double tangent_of_half_angle) const;
};

/// Collects the patches of a scene.
class SceneBuilder {
 public:
  void rectangle(const Vector3& centre, const Vector3& half_u, const Vector3& half_v);
  /// Upright walls and a top over [−x, x] × [−y, y] × [0, height] of the pose; a bottom where asked
  /// for (one that stands on something shows none).
  void box(const Pose& pose, double half_x, double half_y, double height, bool has_bottom = false);
  /// An upright cone's part, without its ends.
  void frustum(const Vector3& base, double base_radius, double top_radius, double height);
  void disc(const Vector3& centre, double radius) { frustum(centre, radius, 0.0, 0.0); }
  /// An upright cylinder with a lid.
  void post(const Vector3& base, double radius, double height);
  void sphere(const Vector3& centre, double radius);

  [[nodiscard]] std::vector<Patch> take() { return std::move(patches_); }

 private:
  std::vector<Patch> patches_;
};

/// The scenes; `seed` stands for the scene's name and size.
[[nodiscard]] std::vector<Patch> make_room(double size, std::uint64_t seed);
[[nodiscard]] std::vector<Patch> make_city(double size, std::uint64_t seed);

}  // namespace gdfmap::synthetic
