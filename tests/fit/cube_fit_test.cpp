#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/fit/cube_fit.hpp>

#include "support/cube_targets.hpp"

namespace gdfmap {
namespace {

CubeFit fit_cube(const CubeSamples& samples, const FitConfig& config,
                 InstructionSet set = best_instruction_set()) {
  return CubeFitter(config, set).fit(std::span(&samples, 1)).front();
}

double wall(const Vector3& p) { return std::abs(p.x() - 0.3); }

TEST(FitCube, MeetsTheThresholdOnAWall) {
  const test::CubeTargets targets(wall);
  const FitConfig config;
  const CubeFit fit = fit_cube(targets.samples(), config);
  ASSERT_TRUE(fit.finite);
  EXPECT_LE(fit.errors.mae, config.mae_threshold);
  EXPECT_LE(fit.errors.mae, fit.errors.rmse);
  EXPECT_LE(fit.errors.p95, fit.errors.max);
  EXPECT_GT(fit.num_iterations, 0);
}

TEST(FitCube, ErrorsAreThoseOfTheStoredGaussians) {
  for (const bool populated : {true, false}) {
    const test::CubeTargets targets(test::planes_distance(11), populated);
    const CubeFit fit = fit_cube(targets.samples(), FitConfig{});
    const Kernel kernel(fit.gaussians);
    const TrainingGrid& grid = training_grid(populated);
    const int k = grid.held_out;
    double sum = 0.0, largest = 0.0;
    for (int n = 0; n < k * k * k; ++n) {
      const Vector3 p(grid.held_out_position(n / (k * k), 0), grid.held_out_position(n / k % k, 0),
                      grid.held_out_position(n % k, 0));
      const double error =
          std::abs(evaluate(kernel.view(), p) - targets.held_out[static_cast<std::size_t>(n)]);
      sum += error;
      largest = std::max(largest, error);
    }
    EXPECT_NEAR(fit.errors.mae, sum / (k * k * k), 1e-6);
    EXPECT_NEAR(fit.errors.max, largest, 1e-6);
  }
}

TEST(FitCube, GrowsOnlyWhereTheErrorAsksForIt) {
  FitConfig config;
  config.mae_threshold = 1.0;
  const test::CubeTargets populated(test::planes_distance(3), true);
  const test::CubeTargets empty(test::planes_distance(3), false);
  EXPECT_EQ(fit_cube(populated.samples(), config).gaussians.size(), 8u);
  config.empty_mae_threshold = 1.0;
  EXPECT_EQ(fit_cube(empty.samples(), config).gaussians.size(), 3u);
  config.mae_threshold = config.empty_mae_threshold = 0.0;
  EXPECT_EQ(fit_cube(populated.samples(), config).gaussians.size(), 32u);
  EXPECT_EQ(fit_cube(empty.samples(), config).gaussians.size(), 12u);
}

TEST(FitCube, IsTheSameAtEveryScale) {
  FitConfig config;
  const test::CubeTargets small(wall);
  const test::CubeTargets large([](const Vector3& p) { return 4.0 * wall(p / 4.0); }, true, 4.0);
  const CubeFit a = fit_cube(small.samples(), config);
  config.mae_threshold *= 4.0;
  const CubeFit b = fit_cube(large.samples(4.0), config);
  ASSERT_EQ(a.gaussians.size(), b.gaussians.size());
  EXPECT_NEAR(b.errors.mae, 4.0 * a.errors.mae, 1e-4);
  for (std::size_t k = 0; k < a.gaussians.size(); ++k) {
    // Root sigma of a length 4 times as long is twice as large.
    EXPECT_NEAR(b.gaussians.at(kRootSigmaX, k), 2.0f * a.gaussians.at(kRootSigmaX, k), 2e-2);
  }
}

TEST(FitCube, GivesTheSameBytesEveryTime) {
  const test::CubeTargets targets(test::planes_distance(8));
  const CubeFit a = fit_cube(targets.samples(), FitConfig{});
  const CubeFit b = fit_cube(targets.samples(), FitConfig{});
  EXPECT_EQ(a.gaussians, b.gaussians);
}

/// Populated and empty cubes of very different need, more than any register has lanes.
TEST(FitCubes, AreTheSameAloneTogetherAndOnEveryInstructionSet) {
  std::vector<test::CubeTargets> targets;
  for (unsigned seed = 0; seed < 21; ++seed) {
    targets.emplace_back(test::planes_distance(seed), seed % 3 > 0);
  }
  std::vector<CubeSamples> samples;
  for (const test::CubeTargets& t : targets) samples.push_back(t.samples());
  FitConfig config;
  config.populated_steps = {4, 8};
  config.empty_steps = {4, 6};
  CubeFitter fitter(config);
  const std::vector<CubeFit> expected = fitter.fit(samples);
  const auto expect_equal = [&](const CubeFit& fit, std::size_t i) {
    EXPECT_EQ(fit.gaussians, expected[i].gaussians) << i;
    EXPECT_EQ(fit.errors.mae, expected[i].errors.mae);
    EXPECT_EQ(fit.errors.max, expected[i].errors.max);
    EXPECT_EQ(fit.num_iterations, expected[i].num_iterations);
  };
  for (std::size_t i = 0; i < samples.size(); ++i) {
    expect_equal(fit_cube(samples[i], config), i);
    expect_equal(fitter.fit(std::span(samples).subspan(i, 1)).front(),
                 i);  // whatever it did before
  }
  for (const InstructionSet set :
       {InstructionSet::kPortable, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
    if (!is_supported(set)) continue;
    const std::vector<CubeFit> fits = CubeFitter(config, set).fit(samples);
    for (std::size_t i = 0; i < samples.size(); ++i) expect_equal(fits[i], i);
  }
}

TEST(FitCube, CeresFitsAsWell) {
  FitConfig config;
  config.populated_steps = {8};
  const test::CubeTargets targets(test::planes_distance(2));
  const CubeFit ours = fit_cube(targets.samples(), config);
  config.solver = Solver::kCeres;
  const CubeFit theirs = fit_cube(targets.samples(), config);
  ASSERT_TRUE(theirs.finite);
  EXPECT_NEAR(theirs.errors.mae, ours.errors.mae, 0.5 * ours.errors.mae + 0.002);
}

TEST(FitCube, RefusesSamplesOfTheOtherClass) {
  const test::CubeTargets targets(wall, false);
  CubeSamples samples = targets.samples();
  samples.populated = true;
  EXPECT_THROW(fit_cube(samples, FitConfig{}), Error);
}

TEST(FitCube, SaysSoWhenTargetsAreNotNumbers) {
  test::CubeTargets targets(wall);
  targets.targets[17] = std::nanf("");
  EXPECT_FALSE(fit_cube(targets.samples(), FitConfig{}).finite);
}

}  // namespace
}  // namespace gdfmap
