#include <cmath>

#include <gtest/gtest.h>

#include <gdfmap/field/gaussians.hpp>

namespace gdfmap {
namespace {

/// Two Gaussians with root sigmas that differ from axis to axis.
Gaussians example() {
  Gaussians gaussians(2);
  const float values[2][kNumGaussianRows] = {{0.2f, 0.3f, 0.4f, 0.7f, 0.8f, 0.9f, 1.5f},
                                             {0.9f, -0.1f, 0.5f, 0.5f, 1.1f, 0.6f, -0.4f}};
  for (std::size_t k = 0; k < 2; ++k) {
    for (std::size_t row = 0; row < kNumGaussianRows; ++row) gaussians.at(row, k) = values[k][row];
  }
  return gaussians;
}

/// The definition, written out.
double reference(const Gaussians& g, const Vector3& p) {
  double sum = 0.0;
  for (std::size_t k = 0; k < g.size(); ++k) {
    double exponent = 0.0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double sigma = std::pow(g.at(kRootSigmaX + a, k), 2.0);
      const double d = p[static_cast<Eigen::Index>(a)] - g.at(kMeanX + a, k);
      exponent += d * d / (sigma * sigma);
    }
    sum += g.at(kWeight, k) * std::exp(-0.5 * exponent);
  }
  return sum;
}

TEST(Kernel, TreatsRootSigmaAsTheRootOfTheStandardDeviation) {
  Gaussians one(1);
  for (std::size_t a = 0; a < 3; ++a) one.at(kRootSigmaX + a, 0) = 2.0f;  // sigma = 4 m
  one.at(kWeight, 0) = 1.0f;
  const Kernel kernel(one);
  EXPECT_NEAR(evaluate(kernel.view(), {4.0, 0.0, 0.0}), std::exp(-0.5), 1e-12);
}

TEST(Kernel, EqualsItsDefinition) {
  const Gaussians gaussians = example();
  const Kernel kernel(gaussians);
  for (const Vector3& p : {Vector3(0, 0, 0), Vector3(0.5, 0.4, 0.9), Vector3(-0.2, 1.2, 0.3)}) {
    EXPECT_NEAR(evaluate(kernel.view(), p), reference(gaussians, p), 1e-6);
    EXPECT_DOUBLE_EQ(evaluate_with_gradient(kernel.view(), p).value, evaluate(kernel.view(), p));
  }
}

TEST(Kernel, GradientEqualsCentralDifferences) {
  const Kernel kernel(example());
  const double h = 1e-5;
  const Vector3 p(0.35, 0.25, 0.6);
  const Vector3 gradient = evaluate_with_gradient(kernel.view(), p).gradient;
  for (int a = 0; a < 3; ++a) {
    const Vector3 step = h * Vector3::Unit(a);
    const double difference =
        (evaluate(kernel.view(), p + step) - evaluate(kernel.view(), p - step)) / (2 * h);
    EXPECT_NEAR(gradient[a], difference, 1e-8);
  }
}

TEST(Kernel, CanBeWrittenAmongOthers) {
  const Gaussians gaussians = example();
  std::vector<float> shared(kNumGaussianRows * 5, 99.0f);
  write_kernel(gaussians, shared.data(), 5, 3);
  const KernelView view{shared.data() + 3, 5, 2};
  const Vector3 p(0.1, 0.2, 0.3);
  EXPECT_EQ(evaluate(view, p), evaluate(Kernel(gaussians).view(), p));
  EXPECT_EQ(shared[0], 99.0f);
}

TEST(Kernel, OfNothingIsZero) {
  const Kernel kernel{Gaussians()};
  EXPECT_EQ(evaluate(kernel.view(), {1, 2, 3}), 0.0);
}

}  // namespace
}  // namespace gdfmap
