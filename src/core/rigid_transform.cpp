#include <cmath>

#include <gdfmap/core/rigid_transform.hpp>

namespace gdfmap {
namespace {

constexpr double kRotationTolerance = 1e-4;
constexpr double kQuaternionTolerance = 1e-3;

Eigen::Isometry3d make_transform(const Vector3& translation, const Eigen::Quaterniond& rotation) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.linear() = rotation.normalized().toRotationMatrix();
  transform.translation() = translation;
  return transform;
}

}  // namespace

std::optional<Eigen::Isometry3d> rigid_transform(const Matrix34& matrix) {
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  const double deviation = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (!matrix.allFinite() || !(deviation < kRotationTolerance) || rotation.determinant() <= 0.0) {
    return std::nullopt;
  }
  return make_transform(matrix.col(3), Eigen::Quaterniond(rotation));
}

std::optional<Eigen::Isometry3d> rigid_transform(const Vector3& translation,
                                                 const Eigen::Quaterniond& rotation) {
  // NaN fails the comparison.
  const bool is_rotation = std::abs(rotation.norm() - 1.0) < kQuaternionTolerance;
  if (!is_rotation || !translation.allFinite()) return std::nullopt;
  return make_transform(translation, rotation);
}

}  // namespace gdfmap
