#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace gdfmap {

/// A position or direction in metres; the frame is named by the variable's suffix (`p_world`).
using Vector3 = Eigen::Vector3d;

/// An axis-aligned box in metres, closed on every side; default-constructed it is empty.
using Box3 = Eigen::AlignedBox3d;

/// A similarity applied to points when they are ingested: p_map = rotation_translation · (scale ·
/// p).
struct PointTransform {
  double scale = 1.0;                                              ///< units of the file to metres
  Eigen::Isometry3d T_map_source = Eigen::Isometry3d::Identity();  ///< translation in metres

  [[nodiscard]] Vector3 apply(const Vector3& p_source) const {
    return T_map_source * (scale * p_source);
  }
};

}  // namespace gdfmap
