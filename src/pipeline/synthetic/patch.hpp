#pragma once

#include <gdfmap/core/geometry.hpp>

namespace gdfmap::synthetic {

enum class PatchKind {
  kRectangle,  ///< centre, half lengths a along u and b along v
  kFrustum,  ///< lateral surface of a cone's part: base centre, radius a there, radius b at height
             ///< h along n. Cylinder: a = b; disc: b = h = 0
  kSphere,   ///< centre, radius a
};

/// One piece of surface, world frame, metres; u, v, n are orthonormal.
struct Patch {
  PatchKind kind = PatchKind::kRectangle;
  Vector3 origin = Vector3::Zero();
  Vector3 u = Vector3::UnitX(), v = Vector3::UnitY(), n = Vector3::UnitZ();
  double a = 0.0, b = 0.0, h = 0.0;
};

/// A point of a surface and the unit normal there.
struct SurfacePoint {
  Vector3 position;
  Vector3 normal;
};

[[nodiscard]] double area(const Patch& patch);
[[nodiscard]] Box3 bounding_box(const Patch& patch);
/// Unsigned, exact up to rounding.
[[nodiscard]] double distance(const Patch& patch, const Vector3& p_world);
/// Uniform by area where s and t are uniform in (0, 1).
[[nodiscard]] SurfacePoint point_on(const Patch& patch, double s, double t);

}  // namespace gdfmap::synthetic
