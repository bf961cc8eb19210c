#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/core/flush_to_zero.hpp>
#include <gdfmap/fit/optimizers.hpp>

#include "support/cube_targets.hpp"

namespace gdfmap {
namespace {

using Problem = TensorProblem<double>;

/// A plain start: Gaussians on the corners of a lattice, least-squares weights.
Problem::Parameters lattice_start(Problem& problem, int count) {
  Problem::Parameters start(kFitParameters, count);
  for (int k = 0; k < count; ++k) {
    start.col(k) << 0.0, 0.2 + 0.6 * (k & 1), 0.2 + 0.6 * (k >> 1 & 1), 0.2 + 0.6 * (k >> 2 & 1),
        std::log(0.5), std::log(0.5), std::log(0.5);
  }
  problem.evaluate(start);
  start.row(kFitWeight) = problem.solve_weights(1e-6).transpose();
  return start;
}

TEST(MinimizeTensor, LowersTheCostAndKeepsTheBounds) {
  const test::CubeTargets targets(test::planes_distance(6));
  Problem problem(targets.targets, 1.0);
  const auto start = lattice_start(problem, 8);
  const double before = problem.evaluate(start);
  const auto result = minimize_tensor(problem, start, {20, 0.0});
  EXPECT_LT(result.cost, 0.5 * before);
  EXPECT_NEAR(problem.evaluate(result.parameters), result.cost, 1e-12);
  EXPECT_GE(result.parameters.middleRows(kFitMean, 3).minCoeff(), kMinMean);
  EXPECT_LE(result.parameters.middleRows(kFitMean, 3).maxCoeff(), kMaxMean);
  EXPECT_GE(result.parameters.bottomRows(3).minCoeff(), std::log(kMinSigma));
  EXPECT_LE(result.parameters.bottomRows(3).maxCoeff(), std::log(kMaxSigma));
}

TEST(MinimizeTensor, RecoversASingleGaussian) {
  const test::CubeTargets targets([](const Vector3& p) {
    return 0.7 * std::exp(-0.5 * (p - Vector3(0.4, 0.5, 0.6)).squaredNorm() / 0.09);
  });
  Problem problem(targets.targets, 1.0);
  Problem::Parameters start(kFitParameters, 1);
  start.col(0) << 0.5, 0.5, 0.4, 0.5, std::log(0.4), std::log(0.3), std::log(0.4);
  const auto result = minimize_tensor(problem, start, {60, 0.0});
  EXPECT_NEAR(result.parameters(kFitWeight, 0), 0.7, 1e-5);
  EXPECT_NEAR(result.parameters(kFitMean, 0), 0.4, 1e-5);
  EXPECT_NEAR(std::exp(result.parameters(kFitLogSigma, 0)), 0.3, 1e-5);
}

TEST(MinimizeTensor, EndsAtTheIterationBudget) {
  const test::CubeTargets targets(test::planes_distance(9));
  Problem problem(targets.targets, 1.0);
  EXPECT_EQ(minimize_tensor(problem, lattice_start(problem, 8), {5, 0.0}).num_iterations, 5);
}

/// Both from the same start to convergence, on 200 cubes. The start is what a short fit of ours
/// reaches: far from any minimum the two run into different ones, in both directions.
TEST(MinimizeTensor, ConvergesAsWellAsCeres) {
  const FlushToZero flush_to_zero;
  std::vector<double> ratios;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const test::CubeTargets targets(test::planes_distance(seed));
    Problem problem(targets.targets, 1.0);
    const auto start = minimize_tensor(problem, lattice_start(problem, 4), {20, 0.0}).parameters;
    const OptimizerOptions to_convergence{300, 1e-7};
    const double theirs = minimize_ceres(problem, start, to_convergence).cost;
    ratios.push_back(minimize_tensor(problem, start, to_convergence).cost / theirs);
  }
  std::sort(ratios.begin(), ratios.end());
  RecordProperty("median", std::to_string(ratios[100]));
  RecordProperty("p95", std::to_string(ratios[189]));
  EXPECT_LE(ratios[100], 1.01);
  EXPECT_LE(ratios[189], 1.10);
}

}  // namespace
}  // namespace gdfmap
