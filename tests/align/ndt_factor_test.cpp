#include <gtest/gtest.h>

#include <gdfmap/align/minimize.hpp>
#include <gdfmap/align/ndt_factor.hpp>

#include "align_fixtures.hpp"

namespace gdfmap {
namespace {

TEST(NdtConstants, AreTheGoldenOnes) {
  struct Golden {
    double resolution, d1, d2, d3;
  };
  for (const Golden& golden :
       {Golden{1.0, -2.217225, 0.433123, 0.597837}, Golden{2.0, -4.196518, 0.248479, 2.677279},
        Golden{0.5, -0.704447, 0.756363, -1.481605}}) {
    const NdtConstants constants = NdtConstants::of(golden.resolution);
    EXPECT_NEAR(constants.d1, golden.d1, 1e-6);
    EXPECT_NEAR(constants.d2, golden.d2, 1e-6);
    EXPECT_NEAR(constants.d3, golden.d3, 1e-6);
  }
}

NdtCells cells_of(const std::vector<Vector3>& points, double edge) {
  const Lattice lattice(1.0);
  VoxelGrid grid(lattice, edge);
  for (const Vector3& p : points) grid.add(*lattice.quantize(p));
  return NdtCells(grid, LatticePoint{});
}

/// The second derivative of the cost at T by differences of two widths, extrapolated (Richardson).
double second_difference(const Factor& factor, const Eigen::Isometry3d& T, int i, int j) {
  const auto cost = [&](const Twist& step) { return factor.cost(factor.retract(T, step), {}); };
  const auto difference = [&](double h) {
    const Twist a = h * Twist::Unit(i), b = h * Twist::Unit(j);
    return (cost(a + b) - cost(a - b) - cost(b - a) + cost(-a - b)) / (4.0 * h * h);
  };
  const double h = 3e-4;
  return (4.0 * difference(h) - difference(2.0 * h)) / 3.0;
}

class NdtFactors : public testing::TestWithParam<NdtNeighborhood> {};

TEST_P(NdtFactors, GradientAndHessianAreThoseOfTheCost) {
  const NdtCells cells = cells_of(test::wave_points(8000, 10.0, 1), 1.0);
  const std::vector<Vector3> source = test::wave_points(1500, 9.0, 2);
  std::mt19937 random(3);
  for (int repetition = 0; repetition < 3; ++repetition) {
    NdtFactor factor(cells, source, {GetParam(), 1});
    const Eigen::Isometry3d T = test::random_pose(random, 0.2, 0.1);
    factor.match(T);
    const Linearization model = factor.linearize(T, {});
    const Twist expected = test::difference_gradient(factor, T, {}, 1e-5);
    EXPECT_LT((model.gradient - expected).norm(), 1e-6 * expected.norm());

    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        EXPECT_NEAR(model.hessian(i, j), second_difference(factor, T, i, j),
                    1e-6 * model.hessian.norm())
            << i << " " << j;
      }
    }
  }
}

TEST_P(NdtFactors, IsTheSameForAnyNumberOfThreads) {
  const NdtCells cells = cells_of(test::wave_points(8000, 10.0, 1), 1.0);
  const std::vector<Vector3> source = test::wave_points(5000, 9.0, 2);
  const Eigen::Isometry3d T(Eigen::Translation3d(0.1, 0.0, 0.1));
  NdtFactor one(cells, source, {GetParam(), 1}), four(cells, source, {GetParam(), 4});
  one.match(T);
  four.match(T);
  EXPECT_EQ(one.linearize(T, {}).hessian, four.linearize(T, {}).hessian);
  EXPECT_EQ(one.linearize(T, {}).gradient, four.linearize(T, {}).gradient);
}

TEST_P(NdtFactors, LeadsNewtonToThePose) {
  const Eigen::Isometry3d T_true =
      exp_twist((Twist() << 0.2, -0.1, 0.1, 0.01, -0.02, 0.03).finished());
  const NdtCells cells = cells_of(test::wave_points(20'000, 10.0, 1), 1.0);
  const std::vector<Vector3> source =
      test::moved(T_true.inverse(), test::wave_points(3000, 9.0, 2));
  NdtFactor factor(cells, source, {GetParam(), 1});
  MinimizeOptions options;
  options.max_iterations = 40;
  const Minimum minimum = minimize(factor, *make_newton(), Eigen::Isometry3d::Identity(), options);
  EXPECT_LT(log_motion(minimum.T * T_true.inverse()).norm(), 0.02);
}

INSTANTIATE_TEST_SUITE_P(All, NdtFactors,
                         testing::Values(NdtNeighborhood::kOwn, NdtNeighborhood::kFaces));

TEST(NdtFactor, PointsWithoutACellCostTheMost) {
  const NdtCells cells = cells_of(test::wave_points(8000, 10.0, 1), 1.0);
  const std::vector<Vector3> source = test::wave_points(100, 9.0, 2);
  NdtFactor factor(cells, source, {});
  const Eigen::Isometry3d away(Eigen::Translation3d(100.0, 0.0, 0.0));
  factor.match(away);
  EXPECT_EQ(factor.num_matched(), 0u);
  EXPECT_NEAR(factor.cost(away, {}), -NdtConstants::of(1.0).d1, 1e-12);
}

}  // namespace
}  // namespace gdfmap
