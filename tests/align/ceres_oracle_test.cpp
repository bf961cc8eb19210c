// The same residuals given to Ceres, which has its own derivatives and its own optimiser: the
// minimum must be the same.

#include <array>

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <gtest/gtest.h>

#include <gdfmap/align/minimize.hpp>
#include <gdfmap/align/surface_factor.hpp>

#include "align_fixtures.hpp"

namespace gdfmap {
namespace {

/// x = (rotation vector, translation) of T; derivatives by Ceres' dual numbers.
struct PlaneResidual {
  Vector3 p, q, n;

  template <typename T>
  bool operator()(const T* x, T* residual) const {
    const T point[3] = {T(p.x()), T(p.y()), T(p.z())};
    T rotated[3];
    ceres::AngleAxisRotatePoint(x, point, rotated);
    residual[0] = T(0.0);
    for (int i = 0; i < 3; ++i) residual[0] += n[i] * (rotated[i] + x[3 + i] - q[i]);
    return true;
  }
};

struct PointResidual {
  Vector3 p, q;

  template <typename T>
  bool operator()(const T* x, T* residual) const {
    const T point[3] = {T(p.x()), T(p.y()), T(p.z())};
    ceres::AngleAxisRotatePoint(x, point, residual);
    for (int i = 0; i < 3; ++i) residual[i] += x[3 + i] - q[i];
    return true;
  }
};

Eigen::Isometry3d pose_of(const std::array<double, 6>& x) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = exp_rotation({x[0], x[1], x[2]});
  T.translation() = Vector3(x[3], x[4], x[5]);
  return T;
}

/// Minimises the frozen residuals of a factor.
Eigen::Isometry3d ceres_minimum(const SurfaceFactor& factor, const SurfaceCloud& target,
                                const SurfaceCloud& source, SurfaceResidual residual,
                                double scale) {
  std::array<double, 6> x{};
  ceres::Problem problem;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const auto match = factor.matches()[i];
    if (!match) continue;
    const Vector3 &p = source.points()[i], &q = target.points()[*match];
    ceres::CostFunction* cost = nullptr;
    if (residual == SurfaceResidual::kPlane) {
      cost = new ceres::AutoDiffCostFunction<PlaneResidual, 1, 6>(
          new PlaneResidual{p, q, target.normals()[*match]});
    } else {
      cost = new ceres::AutoDiffCostFunction<PointResidual, 3, 6>(new PointResidual{p, q});
    }
    problem.AddResidualBlock(cost, new ceres::CauchyLoss(scale), x.data());
  }
  ceres::Solver::Options options;
  options.max_num_iterations = 200;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-16;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return pose_of(x);
}

class CeresOracle : public testing::TestWithParam<SurfaceResidual> {};

TEST_P(CeresOracle, FindsTheSameMinimumOfTheSameResiduals) {
  const SurfaceCloud target(test::corner_points(9000, 6.0, 0.02, 1), 0.25, 1);
  std::mt19937 random(7);
  const SurfaceCloud source(
      test::moved(test::random_pose(random, 0.1, 0.02), test::corner_points(6000, 6.0, 0.02, 2)),
      0.25, 1);
  SurfaceFactor factor(target, source, {GetParam(), 0.6, 1});
  factor.match(Eigen::Isometry3d::Identity());
  const double scale = 0.1;
  const RobustKernel kernel{KernelKind::kCauchy, scale};

  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  const auto rule = make_levenberg_marquardt();
  for (int i = 0; i < 200; ++i) {  // without matching again
    const auto cost = [&](const Twist& step) { return factor.cost(exp_twist(step) * T, kernel); };
    T = exp_twist(rule->step(factor.linearize(T, kernel), {cost, {}})) * T;
  }
  const Eigen::Isometry3d T_ceres = ceres_minimum(factor, target, source, GetParam(), scale);
  EXPECT_LT(log_motion(T_ceres * T.inverse()).norm(), 1e-6);
  EXPECT_NEAR(factor.cost(T, kernel), factor.cost(T_ceres, kernel), 1e-12);
  EXPECT_GT(log_motion(T).norm(), 1e-2);  // there was a way to go
}

INSTANTIATE_TEST_SUITE_P(All, CeresOracle,
                         testing::Values(SurfaceResidual::kPoint, SurfaceResidual::kPlane));

}  // namespace
}  // namespace gdfmap
