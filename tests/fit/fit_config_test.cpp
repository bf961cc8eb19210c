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
  config.max_iterations = 33;
  config.solver = Solver::kCeres;
  EXPECT_EQ(FitConfig::from_canonical(config.canonical()), config);
}

TEST(FitConfig, EveryMemberChangesTheCanonicalText) {
  const FitConfig base;
  std::vector<FitConfig> changed(7, base);
  changed[0].populated_steps = {8};
  changed[1].empty_steps = {8};
  changed[2].mae_threshold *= 2;
  changed[3].mae_threshold_max *= 2;
  changed[4].empty_distance_threshold *= 2;
  changed[5].max_iterations += 1;
  changed[6].solver = Solver::kCeres;
  for (const FitConfig& config : changed) {
    EXPECT_NE(config.canonical(), base.canonical());
    EXPECT_EQ(config.differing_keys(base).size(), 1u);
  }
}

TEST(FitConfig, ThresholdsGrowWithTheCube) {
  const FitConfig config = FitConfig::defaults(4.0);
  EXPECT_DOUBLE_EQ(config.mae_threshold, 4.0 * FitConfig{}.mae_threshold);
  EXPECT_DOUBLE_EQ(config.empty_distance_threshold, 8.0);
}

TEST(FitConfig, RefusesTextThatItDidNotWrite) {
  EXPECT_THROW(FitConfig::from_canonical("adaptive.mae_threshold = 1\n"), Error);
  EXPECT_THROW(FitConfig::from_canonical(""), Error);
}

}  // namespace
}  // namespace gdfmap
