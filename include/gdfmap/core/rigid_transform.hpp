#pragma once

#include <optional>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap {

/// The upper three rows of a transformation: rotation and translation.
using Matrix34 = Eigen::Matrix<double, 3, 4>;

/// The rigid transformation that a matrix of numbers from a file stands for, its rotation made
/// exact. Empty unless all are finite and ‖R·Rᵀ − I‖ < 1e-4, det R > 0: a factor or a reflection is
/// no rounding.
[[nodiscard]] std::optional<Eigen::Isometry3d> rigid_transform(const Matrix34& matrix);

/// The same of a translation and a quaternion. Empty unless all are finite and the quaternion's
/// length is 1 to within 1e-3, as four decimals leave it.
[[nodiscard]] std::optional<Eigen::Isometry3d> rigid_transform(const Vector3& translation,
                                                               const Eigen::Quaterniond& rotation);

}  // namespace gdfmap
