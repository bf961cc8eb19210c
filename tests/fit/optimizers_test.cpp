#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/flush_to_zero.hpp>
#include <gdfmap/fit/optimizers.hpp>

#include "support/cube_targets.hpp"

namespace gdfmap {
namespace {

using Job = OptimizerJob<double>;

/// A plain start: Gaussians on the corners of a lattice, least-squares weights.
FitParameters<double> lattice_start(const CubeProblem& problem, int count) {
  FitParameters<double> start(kFitParameters, count);
  for (int k = 0; k < count; ++k) {
    start.col(k) << 0.0, 0.2 + 0.6 * (k & 1), 0.2 + 0.6 * (k >> 1 & 1), 0.2 + 0.6 * (k >> 2 & 1),
        std::log(0.5), std::log(0.5), std::log(0.5);
  }
  TensorBatch<double> batch(problem.grid, count);
  batch.set_problems({{{0, problem}}});
  batch.set_candidate(0, start);
  batch.evaluate();
  batch.solve_weights(1e-6);
  return batch.candidate(0);
}

Job minimized(Job job, const OptimizerOptions& options) {
  TensorBatch<double> batch(job.problem.grid, static_cast<int>(job.parameters.cols()));
  batch.set_problems({{{0, job.problem}}});
  minimize_tensor(batch, std::span(&job, 1), options);
  return job;
}

TEST(MinimizeTensor, LowersTheCostAndKeepsTheBounds) {
  const test::CubeTargets targets(test::planes_distance(6));
  const CubeProblem problem = targets.problem();
  const FitParameters<double> start = lattice_start(problem, 8);
  const double before = minimized({problem, start}, {0, 0.0}).cost;
  const Job result = minimized({problem, start}, {20, 0.0});
  EXPECT_LT(result.cost, 0.5 * before);
  EXPECT_NEAR(minimized({problem, result.parameters}, {0, 0.0}).cost, result.cost, 1e-12);
  EXPECT_GE(result.parameters.middleRows(kFitMean, 3).minCoeff(), kMinMean);
  EXPECT_LE(result.parameters.middleRows(kFitMean, 3).maxCoeff(), kMaxMean);
  EXPECT_GE(result.parameters.bottomRows(3).minCoeff(), std::log(0.04) - 1e-12);
  EXPECT_LE(result.parameters.bottomRows(3).maxCoeff(), std::log(4.0) + 1e-12);
}

TEST(MinimizeTensor, RecoversASingleGaussian) {
  const test::CubeTargets targets([](const Vector3& p) {
    return 0.7 * std::exp(-0.5 * (p - Vector3(0.4, 0.5, 0.6)).squaredNorm() / 0.09);
  });
  FitParameters<double> start(kFitParameters, 1);
  start.col(0) << 0.5, 0.5, 0.4, 0.5, std::log(0.4), std::log(0.3), std::log(0.4);
  const Job result = minimized({targets.problem(), start}, {60, 0.0});
  EXPECT_NEAR(result.parameters(kFitWeight, 0), 0.7, 1e-5);
  EXPECT_NEAR(result.parameters(kFitMean, 0), 0.4, 1e-5);
  EXPECT_NEAR(std::exp(result.parameters(kFitLogSigma, 0)), 0.3, 1e-5);
}

TEST(MinimizeTensor, EndsAtTheIterationBudget) {
  const test::CubeTargets targets(test::planes_distance(9));
  const CubeProblem problem = targets.problem();
  EXPECT_EQ(minimized({problem, lattice_start(problem, 8)}, {5, 0.0}).num_iterations, 5);
}

/// As many at a time as there are lanes.
void minimize_all(TensorBatch<float>& batch, std::span<OptimizerJob<float>> jobs,
                  const OptimizerOptions& options) {
  const auto lanes = static_cast<std::size_t>(batch.num_lanes());
  while (!jobs.empty()) {
    const auto group = jobs.first(std::min(lanes, jobs.size()));
    std::vector<TensorBatch<float>::LaneProblem> problems;
    for (const OptimizerJob<float>& job : group) {
      problems.push_back({static_cast<int>(problems.size()), job.problem});
    }
    batch.set_problems(problems);
    minimize_tensor(batch, group, options);
    jobs = jobs.subspan(group.size());
  }
}

/// More jobs than lanes, some long, some short.
TEST(MinimizeTensor, TreatsEveryJobAsIfItWereAlone) {
  const FlushToZero flush_to_zero;
  std::vector<test::CubeTargets> targets;
  for (unsigned seed = 0; seed < 37; ++seed) targets.emplace_back(test::planes_distance(seed));
  std::vector<OptimizerJob<float>> jobs;
  for (const test::CubeTargets& t : targets) {
    const CubeProblem problem = t.problem();
    jobs.push_back({problem, lattice_start(problem, 4).cast<float>()});
  }
  std::vector<OptimizerJob<float>> alone = jobs;
  const OptimizerOptions options{20, 1e-2};
  TensorBatch<float> batch(kPopulatedGrid, 4);
  minimize_all(batch, jobs, options);
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    minimize_all(batch, std::span(alone).subspan(i, 1), options);
    EXPECT_EQ(jobs[i].parameters, alone[i].parameters) << i;
    EXPECT_EQ(jobs[i].cost, alone[i].cost);
    EXPECT_EQ(jobs[i].num_iterations, alone[i].num_iterations);
  }
}

TEST(MinimizeTensor, WithoutJobsDoesNothing) {
  TensorBatch<float> batch(kPopulatedGrid, 4);
  minimize_tensor<float>(batch, {}, {});
}

TEST(MinimizeTensor, RefusesAJobWhoseProblemTheBatchDoesNotHold) {
  const test::CubeTargets one(test::planes_distance(1)), other(test::planes_distance(2));
  TensorBatch<double> batch(kPopulatedGrid, 4);
  batch.set_problems({{{0, one.problem()}}});
  Job job{other.problem(), lattice_start(other.problem(), 4)};
  EXPECT_THROW(minimize_tensor(batch, std::span(&job, 1), {}), Error);
}

TEST(MinimizeTensor, RefusesMoreJobsThanLanes) {
  TensorBatch<float> batch(kPopulatedGrid, 4);
  std::vector<OptimizerJob<float>> jobs(static_cast<std::size_t>(batch.num_lanes()) + 1);
  EXPECT_THROW(minimize_tensor<float>(batch, jobs, {}), Error);
}

/// Both from the same start to convergence, on 200 cubes. The start is what a short fit of ours
/// reaches: far from any minimum the two run into different ones, in both directions.
TEST(MinimizeTensor, ConvergesAsWellAsCeres) {
  const FlushToZero flush_to_zero;
  std::vector<double> ratios;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const test::CubeTargets targets(test::planes_distance(seed), false);
    const CubeProblem problem = targets.problem();
    const Job start = minimized({problem, lattice_start(problem, 4)}, {20, 0.0});
    const OptimizerOptions to_convergence{300, 1e-7};
    Job theirs = start;
    minimize_ceres(theirs, to_convergence);
    ratios.push_back(minimized(start, to_convergence).cost / theirs.cost);
  }
  std::sort(ratios.begin(), ratios.end());
  RecordProperty("median", std::to_string(ratios[100]));
  RecordProperty("p95", std::to_string(ratios[189]));
  EXPECT_LE(ratios[100], 1.01);
  EXPECT_LE(ratios[189], 1.10);
}

}  // namespace
}  // namespace gdfmap
