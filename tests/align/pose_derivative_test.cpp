#include <gtest/gtest.h>

#include <gdfmap/align/pose_derivative.hpp>
#include <gdfmap/core/error.hpp>

#include "align_fixtures.hpp"
#include "support/lidar_room.hpp"

namespace gdfmap {
namespace {

const RobustKernel kKernel{KernelKind::kCauchy, 0.1};

struct Scene {
  SurfaceCloud target{test::wave_points(4000, 8.0, 1), 0.2, 1};
  std::vector<Vector3> points =
      test::moved(exp_twist((Twist() << 0.02, -0.03, 0.01, 0.004, 0.006, -0.005).finished()),
                  test::wave_points(120, 7.0, 2));

  [[nodiscard]] PoseDerivative derivative_of(const std::vector<Vector3>& source_points) const {
    const SurfaceCloud source(source_points, 0.0, 1);
    SurfaceFactor factor(target, source, {SurfaceResidual::kPlane, 1.0, 1});
    factor.match(Eigen::Isometry3d::Identity());
    return differentiate_pose(factor, Eigen::Isometry3d::Identity(), kKernel);
  }
};

TEST(PoseDerivative, IsWhatMovingAPointDoes) {
  const Scene scene;
  const PoseDerivative derivative = scene.derivative_of(scene.points);
  double largest = 0.0;
  for (const std::size_t i : {0u, 13u, 57u, 111u}) {
    for (int axis = 0; axis < 3; ++axis) {
      const double h = 1e-5;
      std::vector<Vector3> up = scene.points, down = scene.points;
      up[i][axis] += h;
      down[i][axis] -= h;
      const Twist difference =
          log_motion(scene.derivative_of(up).T * scene.derivative_of(down).T.inverse()) / (2.0 * h);
      const Twist expected = derivative.by_point[i].col(axis);
      EXPECT_LT((difference - expected).norm(), 1e-4 * expected.norm() + 1e-8) << i << " " << axis;
      largest = std::max(largest, expected.norm());
    }
  }
  EXPECT_GT(largest, 1e-3);
}

TEST(PoseDerivative, CovarianceIsThatOfPosesFromNoisyPoints) {
  const Scene scene;
  const Matrix6 expected = scene.derivative_of(scene.points).covariance(1e-7);
  const Eigen::Isometry3d T = scene.derivative_of(scene.points).T;
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 1e-7);  // matches stay as they are
  Matrix6 measured = Matrix6::Zero();
  constexpr int kRuns = 400;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<Vector3> points = scene.points;
    for (Vector3& p : points) p += Vector3(noise(random), noise(random), noise(random));
    const Twist error = log_motion(scene.derivative_of(points).T * T.inverse());
    measured += error * error.transpose() / kRuns;
  }
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(measured(i, i) / expected(i, i), 1.0, 0.3) << i;
  }
}

TEST(PoseDerivative, OfAWholeRegistrationIsFoundAtItsPose) {
  test::LidarOptions small;
  small.num_columns = 256;
  const test::LidarPair pair = test::lidar_pair(1, small);
  const MapWindow target(pair.target);
  const Scan source(pair.source);
  const RegistrationResult result = make_registration_method("gradicp")->provide(
      target, source, Eigen::Isometry3d::Identity(), {});
  const PoseDerivative derivative =
      differentiate_gradicp(target, source, result.T_target_source, {});
  const Eigen::Isometry3d T_local =
      between_origins(result.T_target_source, target.origin_world(), source.origin());
  EXPECT_LT(log_motion(derivative.T * T_local.inverse()).norm(), 1e-3);
  EXPECT_EQ(derivative.by_point.size(), source.surface(0.25, 1).size());
  // All points together move the pose with them: their translations by δ shift T by −R δ.
  Eigen::Matrix<double, 6, 3> sum = Eigen::Matrix<double, 6, 3>::Zero();
  for (const auto& D : derivative.by_point) sum += D;
  EXPECT_LT((sum.topRows<3>() + derivative.T.linear()).norm(), 1e-6);
  EXPECT_LT(sum.bottomRows<3>().norm(), 1e-6);
}

TEST(PoseDerivative, IsRefusedWhereThePoseIsUndetermined) {
  std::vector<Vector3> plane;
  for (int x = 0; x < 20; ++x) {
    for (int y = 0; y < 20; ++y) plane.emplace_back(0.1 * x, 0.1 * y, 0.0);
  }
  const SurfaceCloud cloud(plane, 0.0, 1);
  SurfaceFactor planes(cloud, cloud, {SurfaceResidual::kPlane, 1.0, 1});
  planes.match(Eigen::Isometry3d::Identity());
  EXPECT_THROW(differentiate_pose(planes, Eigen::Isometry3d::Identity(), kKernel), Error);
  SurfaceFactor points(cloud, cloud, {SurfaceResidual::kPoint, 1.0, 1});
  EXPECT_THROW(differentiate_pose(points, Eigen::Isometry3d::Identity(), kKernel), Error);
}

}  // namespace
}  // namespace gdfmap
