#include "patch.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gdfmap::synthetic {
namespace {

using std::numbers::pi;

double square(double x) { return x * x; }

double slant_length(const Patch& patch) { return std::hypot(patch.b - patch.a, patch.h); }

double rectangle_distance(const Patch& patch, const Vector3& d) {
  const double x = std::max(std::abs(d.dot(patch.u)) - patch.a, 0.0);
  const double y = std::max(std::abs(d.dot(patch.v)) - patch.b, 0.0);
  return std::sqrt(square(x) + square(y) + square(d.dot(patch.n)));
}

/// In the half-plane of the point and the axis the surface is a segment from (a, 0) to (b, h).
double frustum_distance(const Patch& patch, const Vector3& d) {
  const double radius = std::sqrt(square(d.dot(patch.u)) + square(d.dot(patch.v)));
  const double height = d.dot(patch.n);
  const double dr = patch.b - patch.a;
  const double along = (radius - patch.a) * dr + height * patch.h;
  const double t = std::clamp(along / (square(dr) + square(patch.h)), 0.0, 1.0);
  return std::sqrt(square(radius - patch.a - t * dr) + square(height - t * patch.h));
}

SurfacePoint point_on_rectangle(const Patch& patch, double s, double t) {
  return {patch.origin + (2.0 * s - 1.0) * patch.a * patch.u + (2.0 * t - 1.0) * patch.b * patch.v,
          patch.n};
}

SurfacePoint point_on_frustum(const Patch& patch, double s, double t) {
  const double a = patch.a, b = patch.b;
  // Area grows with the square of the radius; the second form is right for cylinders too.
  const double radius = std::sqrt(square(a) + s * (square(b) - square(a)));
  const double fraction = s * (a + b) / (a + radius);
  const double angle = 2.0 * pi * t;
  const Vector3 outward = std::cos(angle) * patch.u + std::sin(angle) * patch.v;
  const Vector3 normal = (patch.h * outward + (a - b) * patch.n) / slant_length(patch);
  return {patch.origin + radius * outward + fraction * patch.h * patch.n, normal};
}

SurfacePoint point_on_sphere(const Patch& patch, double s, double t) {
  const double z = 2.0 * s - 1.0;
  const double ring = std::sqrt(1.0 - square(z));
  const double angle = 2.0 * pi * t;
  const Vector3 normal(ring * std::cos(angle), ring * std::sin(angle), z);
  return {patch.origin + patch.a * normal, normal};
}

/// Half extents of a disc's bounding box.
Vector3 disc_extent(const Vector3& normal, double radius) {
  return radius * (Vector3::Ones() - normal.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
}

}  // namespace

double area(const Patch& patch) {
  switch (patch.kind) {
    case PatchKind::kRectangle:
      return 4.0 * patch.a * patch.b;
    case PatchKind::kFrustum:
      return pi * (patch.a + patch.b) * slant_length(patch);
    case PatchKind::kSphere:
      break;
  }
  return 4.0 * pi * square(patch.a);
}

Box3 bounding_box(const Patch& patch) {
  switch (patch.kind) {
    case PatchKind::kRectangle: {
      const Vector3 extent = patch.a * patch.u.cwiseAbs() + patch.b * patch.v.cwiseAbs();
      return {patch.origin - extent, patch.origin + extent};
    }
    case PatchKind::kFrustum: {
      const Vector3 top = patch.origin + patch.h * patch.n;
      const Vector3 base_extent = disc_extent(patch.n, patch.a);
      const Vector3 top_extent = disc_extent(patch.n, patch.b);
      return {(patch.origin - base_extent).cwiseMin(top - top_extent),
              (patch.origin + base_extent).cwiseMax(top + top_extent)};
    }
    case PatchKind::kSphere:
      break;
  }
  const Vector3 extent = Vector3::Constant(patch.a);
  return {patch.origin - extent, patch.origin + extent};
}

double distance(const Patch& patch, const Vector3& p_world) {
  const Vector3 d = p_world - patch.origin;
  switch (patch.kind) {
    case PatchKind::kRectangle:
      return rectangle_distance(patch, d);
    case PatchKind::kFrustum:
      return frustum_distance(patch, d);
    case PatchKind::kSphere:
      break;
  }
  return std::abs(d.norm() - patch.a);
}

SurfacePoint point_on(const Patch& patch, double s, double t) {
  switch (patch.kind) {
    case PatchKind::kRectangle:
      return point_on_rectangle(patch, s, t);
    case PatchKind::kFrustum:
      return point_on_frustum(patch, s, t);
    case PatchKind::kSphere:
      break;
  }
  return point_on_sphere(patch, s, t);
}

}  // namespace gdfmap::synthetic
