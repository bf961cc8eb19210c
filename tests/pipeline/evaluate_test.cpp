#include <cmath>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/evaluate.hpp>
#include <gdfmap/pipeline/model_exchange.hpp>
#include <gdfmap/train/train.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

/// A trained sphere, as map and as model.
class EvaluateTest : public testing::Test {
 protected:
  EvaluateTest() {
    Map map = test::map_of(directory_ / "a.gdfmap", points_);
    train(map);
    export_model(map, directory_ / "a.bin");
    options_.num_samples = 5000;
  }
  test::TemporaryDirectory directory_;
  const std::vector<Vector3> points_ = test::scene_points("sphere", 20000, 2.0);
  EvaluateOptions options_;
};

TEST_F(EvaluateTest, ComparesAMapWithItsOwnPoints) {
  const Evaluation result = evaluate(directory_ / "a.gdfmap", options_);
  EXPECT_EQ(result.num_fine + result.num_coarse + result.num_far + result.num_unknown, 5000u);
  EXPECT_EQ(result.all.num_samples, result.num_fine);
  EXPECT_EQ(result.all.num_samples, result.populated.num_samples + result.empty.num_samples);
  EXPECT_GT(result.outer_shell.num_samples, 0u);
  EXPECT_LT(result.all.mae, 0.02);
  EXPECT_LE(result.all.median, result.all.p95);
  EXPECT_LE(result.all.p95, result.all.max);
  EXPECT_NEAR(result.all.gradient_norm_mean, 1.0, 0.05);
  EXPECT_LT(result.all.gradient_angle_mean_deg, 15.0);
  EXPECT_EQ(result.all.num_nan_gradients, 0u);
  EXPECT_GT(result.mean_expected_error, 0.0);
}

TEST_F(EvaluateTest, BandsDivideTheSamplesByTrueDistance) {
  const Evaluation result = evaluate(directory_ / "a.gdfmap", options_);
  std::uint64_t sum = 0;
  for (const BandStatistics& band : result.bands) sum += band.errors.num_samples;
  EXPECT_EQ(sum, result.all.num_samples);
}

TEST_F(EvaluateTest, ACloudFileIsAsGoodAsTheMapsOwnPoints) {
  const Evaluation own = evaluate(directory_ / "a.gdfmap", options_);
  options_.cloud = directory_.path() / "a.gdfmap.ply";
  const Evaluation file = evaluate(directory_ / "a.gdfmap", options_);
  EXPECT_DOUBLE_EQ(file.all.mae, own.all.mae);
  EXPECT_EQ(file.populated.num_samples, own.populated.num_samples);
}

TEST_F(EvaluateTest, AModelFileIsJudgedAsItsMap) {
  options_.cloud = directory_.path() / "a.gdfmap.ply";
  options_.step = 0.2;
  options_.blend = BlendMode::kGdf1;
  const Evaluation of_map = evaluate(directory_ / "a.gdfmap", options_);
  const Evaluation of_model = evaluate(directory_ / "a.bin", options_);
  EXPECT_EQ(of_model.all.num_samples, of_map.all.num_samples);
  EXPECT_NEAR(of_model.all.mae, of_map.all.mae, 1e-5);
}

TEST_F(EvaluateTest, RegularSamplesAreTheAncestors) {
  options_.step = 0.25;
  options_.blend = BlendMode::kGdf1;
  const Evaluation result = evaluate(directory_ / "a.gdfmap", options_);
  Map map = Map::open(directory_ / "a.gdfmap", Access::kRead);
  EXPECT_EQ(result.all.num_samples,
            static_cast<std::uint64_t>(map.cubes().totals().num_cubes) * 64);
}

TEST_F(EvaluateTest, SetsAsideWhatThePointsCannotTell) {
  options_.truth_scene = "sphere";
  options_.truth_size = 2.0;
  const Evaluation tolerant = evaluate(directory_ / "a.gdfmap", options_);
  EXPECT_GT(tolerant.num_set_aside, 0u);
  options_.truth_gap = 10.0;
  EXPECT_EQ(evaluate(directory_ / "a.gdfmap", options_).num_set_aside, 0u);
}

TEST_F(EvaluateTest, TheSeedDecidesTheSamples) {
  const double first = evaluate(directory_ / "a.gdfmap", options_).all.mae;
  EXPECT_EQ(evaluate(directory_ / "a.gdfmap", options_).all.mae, first);
  options_.seed = 2;
  EXPECT_NE(evaluate(directory_ / "a.gdfmap", options_).all.mae, first);
}

TEST_F(EvaluateTest, SaysWhenThereIsNothingToCompare) {
  EXPECT_THROW(evaluate(directory_ / "a.bin", options_), Error);
  { Map map = Map::create(directory_ / "empty.gdfmap"); }
  EXPECT_THROW(evaluate(directory_ / "empty.gdfmap", options_), Error);
  options_.step = 5.0;
  EXPECT_THROW(evaluate(directory_ / "a.gdfmap", options_), Error);
}

}  // namespace
}  // namespace gdfmap
