#include "scene_builder.hpp"

namespace gdfmap::synthetic {

Pose Pose::at(double x, double y, double z) const {
  return {position + x * axis_x() + y * axis_y() + Vector3(0.0, 0.0, z), cosine, sine};
}

Pose Pose::turned(double tangent_of_half_angle) const {
  const double t = tangent_of_half_angle;
  const double c = (1.0 - t * t) / (1.0 + t * t), s = 2.0 * t / (1.0 + t * t);
  return {position, cosine * c - sine * s, sine * c + cosine * s};
}

void SceneBuilder::rectangle(const Vector3& centre, const Vector3& half_u, const Vector3& half_v) {
  Patch patch;
  patch.kind = PatchKind::kRectangle;
  patch.origin = centre;
  patch.a = half_u.norm();
  patch.b = half_v.norm();
  patch.u = half_u / patch.a;
  patch.v = half_v / patch.b;
  patch.n = patch.u.cross(patch.v);
  patches_.push_back(patch);
}

void SceneBuilder::box(const Pose& pose, double half_x, double half_y, double height,
                       bool has_bottom) {
  const Vector3 x = half_x * pose.axis_x(), y = half_y * pose.axis_y();
  const Vector3 z(0.0, 0.0, 0.5 * height);
  const Vector3 centre = pose.position + z;
  rectangle(centre + x, y, z);
  rectangle(centre - x, -y, z);
  rectangle(centre + y, -x, z);
  rectangle(centre - y, x, z);
  rectangle(centre + z, x, y);
  if (has_bottom) rectangle(centre - z, y, x);
}

void SceneBuilder::frustum(const Vector3& base, double base_radius, double top_radius,
                           double height) {
  Patch patch;
  patch.kind = PatchKind::kFrustum;
  patch.origin = base;
  patch.a = base_radius;
  patch.b = top_radius;
  patch.h = height;
  patches_.push_back(patch);
}

void SceneBuilder::post(const Vector3& base, double radius, double height) {
  frustum(base, radius, radius, height);
  disc(base + Vector3(0.0, 0.0, height), radius);
}

void SceneBuilder::sphere(const Vector3& centre, double radius) {
  Patch patch;
  patch.kind = PatchKind::kSphere;
  patch.origin = centre;
  patch.a = radius;
  patches_.push_back(patch);
}

}  // namespace gdfmap::synthetic
