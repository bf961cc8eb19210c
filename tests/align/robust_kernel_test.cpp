#include <gtest/gtest.h>

#include <gdfmap/align/robust_kernel.hpp>

namespace gdfmap {
namespace {

class RobustKernels : public testing::TestWithParam<KernelKind> {};

TEST_P(RobustKernels, WeightAndCurvatureAreDerivativesOfTheCost) {
  const RobustKernel kernel{GetParam(), 0.3};
  for (const double r : {0.01, 0.1, 0.29, 0.31, 0.8, 3.0}) {
    const double h = 1e-5;
    const double slope = (kernel.cost(r + h) - kernel.cost(r - h)) / (2.0 * h);
    EXPECT_NEAR(kernel.weight(r) * r, slope, 1e-8) << r;
    const auto first = [&](double x) { return kernel.weight(x) * x; };
    EXPECT_NEAR(kernel.curvature(r), (first(r + h) - first(r - h)) / (2.0 * h), 1e-8) << r;
  }
}

TEST_P(RobustKernels, IsTheSquareFarBelowItsScale) {
  const RobustKernel kernel{GetParam(), 2.0};
  EXPECT_NEAR(kernel.cost(0.01), 0.5e-4, 1e-8);
  EXPECT_NEAR(kernel.weight(0.0), 1.0, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(All, RobustKernels,
                         testing::Values(KernelKind::kNone, KernelKind::kHuber, KernelKind::kCauchy,
                                         KernelKind::kGemanMcClure));

TEST(RobustKernel, GemanMcClureBoundsWhatAnOutlierCosts) {
  const RobustKernel kernel{KernelKind::kGemanMcClure, 0.1};
  EXPECT_LT(kernel.cost(1e6), 0.5 * 0.1 * 0.1 * 1.000001);
}

TEST(KernelSchedule, FallsFromFirstToLastAndStaysThere) {
  const KernelSchedule schedule{KernelKind::kCauchy, 0.8, 0.1, 0.5};
  EXPECT_DOUBLE_EQ(schedule.at(0).scale, 0.8);
  EXPECT_DOUBLE_EQ(schedule.at(1).scale, 0.4);
  EXPECT_DOUBLE_EQ(schedule.at(3).scale, 0.1);
  EXPECT_DOUBLE_EQ(schedule.at(9).scale, 0.1);
  EXPECT_FALSE(schedule.is_final(2));
  EXPECT_TRUE(schedule.is_final(3));
}

}  // namespace
}  // namespace gdfmap
