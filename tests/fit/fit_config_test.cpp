#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/fit/fit_config.hpp>

namespace gdfmap {
namespace {

TEST(FitConfig, CanonicalTextReadsBack) {
  FitConfig config;
  config.populated_steps = {4, 8, 12};
  config.empty_steps = {2};
  config.mae_threshold = 0.1 + 0.2;
  config.empty_mae_threshold = 0.7;
  config.max_iterations = 33;
  config.solver = Solver::kCeres;
  config.codec = CubeCodec::kFloat32;
  EXPECT_EQ(FitConfig::from_canonical(config.canonical()), config);
}

TEST(FitConfig, EveryMemberChangesTheCanonicalText) {
  const FitConfig base;
  std::vector<FitConfig> changed(9, base);
  changed[0].populated_steps = {8};
  changed[1].empty_steps = {8};
  changed[2].mae_threshold *= 2;
  changed[3].mae_threshold_max *= 2;
  changed[4].empty_distance_threshold *= 2;
  changed[5].max_iterations += 1;
  changed[6].solver = Solver::kCeres;
  changed[7].codec = CubeCodec::kFloat32;
  changed[8].empty_mae_threshold *= 2;
  for (const FitConfig& config : changed) {
    EXPECT_NE(config.canonical(), base.canonical());
    EXPECT_EQ(config.differing_keys(base).size(), 1u);
  }
}

TEST(FitConfig, ThresholdsGrowWithTheCube) {
  const FitConfig config = FitConfig::defaults(4.0);
  EXPECT_DOUBLE_EQ(config.mae_threshold, 4.0 * FitConfig{}.mae_threshold);
  EXPECT_DOUBLE_EQ(config.empty_mae_threshold, 4.0 * FitConfig{}.empty_mae_threshold);
  EXPECT_DOUBLE_EQ(config.empty_distance_threshold, 8.0);
}

TEST(FitConfig, PresetsGoFromFastToAccurate) {
  const FitConfig fast = FitConfig::preset(FitPreset::kFast, 1.0);
  const FitConfig balanced = FitConfig::preset(FitPreset::kBalanced, 1.0);
  const FitConfig best = FitConfig::preset(FitPreset::kBest, 1.0);
  EXPECT_EQ(balanced, FitConfig{});
  EXPECT_GT(fast.mae_threshold, balanced.mae_threshold);
  EXPECT_GT(balanced.mae_threshold, best.mae_threshold);
  EXPECT_LT(fast.populated_steps.back(), best.populated_steps.back());
  EXPECT_DOUBLE_EQ(FitConfig::preset(FitPreset::kBest, 4.0).mae_threshold, 4 * best.mae_threshold);
  EXPECT_EQ(find_preset("best"), FitPreset::kBest);
  EXPECT_FALSE(find_preset("Best").has_value());
}

TEST(FitConfig, RefusesTextThatItDidNotWrite) {
  EXPECT_THROW(FitConfig::from_canonical("adaptive.mae_threshold = 1\n"), Error);
  EXPECT_THROW(FitConfig::from_canonical(""), Error);
}

}  // namespace
}  // namespace gdfmap
