#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <unsupported/Eigen/MatrixFunctions>

#include <gdfmap/align/rigid_motion.hpp>

#include "align_fixtures.hpp"

namespace gdfmap {
namespace {

TEST(RigidMotion, ExpIsTheMatrixExponential) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (const double size : {1e-9, 1e-5, 1e-3, 0.3, 1.7}) {
    Twist twist;
    for (int i = 0; i < 6; ++i) twist[i] = size * unit(random);
    Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
    generator.topLeftCorner<3, 3>() = skew(twist.tail<3>());
    generator.topRightCorner<3, 1>() = twist.head<3>();
    const Eigen::Matrix4d expected = generator.exp();
    EXPECT_LT((exp_twist(twist).matrix() - expected).cwiseAbs().maxCoeff(), 1e-13) << size;
  }
}

TEST(RigidMotion, LogIsTheInverseOfExp) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (const double size : {1e-12, 1e-6, 1e-4, 1e-2, 1.0, 1.7}) {
    Twist twist;
    for (int i = 0; i < 6; ++i) twist[i] = size * unit(random);
    EXPECT_LT((log_motion(exp_twist(twist)) - twist).norm(), 1e-11 * std::max(1e-3, size)) << size;
  }
}

TEST(RigidMotion, TinyAnglesKeepTheirDigits) {
  const Eigen::Isometry3d T = motion_from_angles(Vector3::Zero(), {0.0, 0.0, 1e-9});
  EXPECT_NEAR(rotation_angle(T), 1e-9, 1e-16);
}

TEST(RigidMotion, AnglesAreRollThenPitchThenYaw) {
  const double quarter = 0.5 * std::numbers::pi;
  const Eigen::Isometry3d T = motion_from_angles({1.0, 2.0, 3.0}, {quarter, 0.0, quarter});
  // Roll takes y to z; yaw takes x to y.
  EXPECT_LT((T * Vector3::UnitY() - Vector3(1.0, 2.0, 4.0)).norm(), 1e-15);
  EXPECT_LT((T * Vector3::UnitX() - Vector3(1.0, 3.0, 3.0)).norm(), 1e-15);
}

TEST(RigidMotion, MovedOriginsAreTheSameMotion) {
  std::mt19937 random(3);
  const Eigen::Isometry3d T = test::random_pose(random, 5.0, 1.0);
  const Vector3 target_origin(300.0, -20.0, 7.0), source_origin(10.0, 20.0, 30.0);
  const Eigen::Isometry3d local = between_origins(T, target_origin, source_origin);
  const Vector3 p(1.0, -2.0, 3.0);
  EXPECT_LT((local * (p - source_origin) + target_origin - T * p).norm(), 1e-12);
}

}  // namespace
}  // namespace gdfmap
