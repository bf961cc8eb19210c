#include <gtest/gtest.h>

#include <gdfmap/align/surface_factor.hpp>

#include "align_fixtures.hpp"

namespace gdfmap {
namespace {

struct Scene {
  SurfaceCloud target{test::wave_points(4000, 10.0, 1), 0.2, 1};
  SurfaceCloud source{test::wave_points(3000, 10.0, 2), 0.2, 1};
};

class SurfaceFactors : public testing::TestWithParam<SurfaceResidual> {};

TEST_P(SurfaceFactors, GradientIsThatOfTheCost) {
  const Scene scene;
  std::mt19937 random(3);
  for (const KernelKind kind : {KernelKind::kNone, KernelKind::kCauchy}) {
    SurfaceFactor factor(scene.target, scene.source, {GetParam(), 0.8, 1});
    const Eigen::Isometry3d T = test::random_pose(random, 0.1, 0.03);
    factor.match(T);
    const RobustKernel kernel{kind, 0.2};
    const Linearization model = factor.linearize(T, kernel);
    const Twist expected = test::difference_gradient(factor, T, kernel);
    EXPECT_LT((model.gradient - expected).norm(), 1e-7 * (1.0 + expected.norm()));
    EXPECT_NEAR(model.cost, factor.cost(T, kernel), 1e-12);
  }
}

TEST_P(SurfaceFactors, IsTheSameForAnyNumberOfThreads) {
  const Scene scene;
  const Eigen::Isometry3d T = Eigen::Isometry3d(Eigen::Translation3d(0.1, 0.05, 0.0));
  SurfaceFactor one(scene.target, scene.source, {GetParam(), 0.8, 1});
  SurfaceFactor four(scene.target, scene.source, {GetParam(), 0.8, 4});
  one.match(T);
  four.match(T);
  const RobustKernel kernel{KernelKind::kHuber, 0.1};
  EXPECT_EQ(one.linearize(T, kernel).hessian, four.linearize(T, kernel).hessian);
  EXPECT_EQ(one.linearize(T, kernel).gradient, four.linearize(T, kernel).gradient);
  EXPECT_EQ(one.cost(T, kernel), four.cost(T, kernel));
}

TEST_P(SurfaceFactors, LosingPointsIsNotRewarded) {
  const Scene scene;
  SurfaceFactor factor(scene.target, scene.source, {GetParam(), 0.5, 1});
  const RobustKernel kernel;
  const Eigen::Isometry3d there = Eigen::Isometry3d::Identity();
  const Eigen::Isometry3d away(Eigen::Translation3d(7.0, 0.0, 0.0));
  factor.match(there);
  const double with_all = factor.cost(there, kernel);
  factor.match(away);
  EXPECT_LT(factor.num_matched(), scene.source.size() / 2);
  EXPECT_GT(factor.cost(away, kernel), with_all);
}

INSTANTIATE_TEST_SUITE_P(All, SurfaceFactors,
                         testing::Values(SurfaceResidual::kPoint, SurfaceResidual::kPlane,
                                         SurfaceResidual::kGicp));

TEST(SurfaceFactor, TheGicpResidualBetweenParallelPlanesIsTheirDistance) {
  std::vector<Vector3> plane;
  for (int x = 0; x < 20; ++x) {
    for (int y = 0; y < 20; ++y) plane.emplace_back(0.1 * x, 0.1 * y, 0.0);
  }
  const SurfaceCloud cloud(plane, 0.0, 1);
  SurfaceFactor factor(cloud, cloud, {SurfaceResidual::kGicp, 1.0, 1});
  const Eigen::Isometry3d T(Eigen::Translation3d(0.0, 0.0, 0.03));
  factor.match(T);
  EXPECT_NEAR(factor.cost(T, RobustKernel{}), 0.5 * 0.03 * 0.03, 1e-12);
}

}  // namespace
}  // namespace gdfmap
