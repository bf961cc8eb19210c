#include <cmath>

#include <gdfmap/align/rigid_motion.hpp>

namespace gdfmap {
namespace {

/// Below this angle the series replace the quotients, which lose their digits.
constexpr double kSmallAngle = 1e-4;

/// sin θ / θ, (1 − cos θ) / θ² and (θ − sin θ) / θ³.
struct Coefficients {
  double a, b, c;

  explicit Coefficients(double angle) {
    const double squared = angle * angle;
    if (angle < kSmallAngle) {
      a = 1.0 - squared / 6.0;
      b = 0.5 - squared / 24.0;
      c = 1.0 / 6.0 - squared / 120.0;
    } else {
      a = std::sin(angle) / angle;
      b = (1.0 - std::cos(angle)) / squared;
      c = (angle - std::sin(angle)) / (squared * angle);
    }
  }
};

Vector3 log_rotation(const Eigen::Matrix3d& rotation) {
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  const double factor = sine == 0.0 ? 2.0 : 2.0 * std::atan2(sine, q.w()) / sine;
  return factor * q.vec();
}

}  // namespace

Eigen::Matrix3d skew(const Vector3& w) {
  Eigen::Matrix3d result;
  result << 0.0, -w.z(), w.y(), w.z(), 0.0, -w.x(), -w.y(), w.x(), 0.0;
  return result;
}

Eigen::Matrix3d exp_rotation(const Vector3& w) {
  const Coefficients k(w.norm());
  const Eigen::Matrix3d W = skew(w);
  return Eigen::Matrix3d::Identity() + k.a * W + k.b * W * W;
}

Eigen::Isometry3d exp_twist(const Twist& twist) {
  const Vector3 w = twist.tail<3>();
  const Coefficients k(w.norm());
  const Eigen::Matrix3d W = skew(w);
  const Eigen::Matrix3d V = Eigen::Matrix3d::Identity() + k.b * W + k.c * W * W;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  // Through a quaternion, so that a long product of motions stays a rotation.
  T.linear() = Eigen::Quaterniond(exp_rotation(w)).normalized().toRotationMatrix();
  T.translation() = V * twist.head<3>();
  return T;
}

Twist log_motion(const Eigen::Isometry3d& T) {
  const Vector3 w = log_rotation(T.linear());
  const Coefficients k(w.norm());
  const Eigen::Matrix3d W = skew(w);
  const Eigen::Matrix3d V = Eigen::Matrix3d::Identity() + k.b * W + k.c * W * W;
  Twist twist;
  twist << V.partialPivLu().solve(T.translation()), w;
  return twist;
}

double rotation_angle(const Eigen::Isometry3d& T) { return log_rotation(T.linear()).norm(); }

Eigen::Isometry3d motion_from_angles(const Vector3& translation, const Vector3& roll_pitch_yaw) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = (Eigen::AngleAxisd(roll_pitch_yaw.z(), Vector3::UnitZ()) *
                Eigen::AngleAxisd(roll_pitch_yaw.y(), Vector3::UnitY()) *
                Eigen::AngleAxisd(roll_pitch_yaw.x(), Vector3::UnitX()))
                   .toRotationMatrix();
  T.translation() = translation;
  return T;
}

Eigen::Isometry3d between_origins(const Eigen::Isometry3d& T_target_source,
                                  const Vector3& target_origin, const Vector3& source_origin) {
  Eigen::Isometry3d T = T_target_source;
  T.translation() = T_target_source * source_origin - target_origin;
  return T;
}

}  // namespace gdfmap
