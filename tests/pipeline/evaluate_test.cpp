#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/evaluate.hpp>
#include <gdfmap/pipeline/field_access.hpp>
#include <gdfmap/pipeline/ingest.hpp>
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
  EXPECT_EQ(result.answers.total(), 5000u);
  EXPECT_EQ(result.all.num_samples, result.answers.num_fine);
  EXPECT_EQ(result.all.num_samples, result.populated.num_samples + result.empty.num_samples);
  EXPECT_GT(result.outer_shell.num_samples, 0u);
  EXPECT_LT(result.all.mae, 0.02);
  EXPECT_LE(result.all.median, result.all.p95);
  EXPECT_LE(result.all.p95, result.all.max);
  EXPECT_NEAR(result.all.gradient_norm_mean, 1.0, 0.05);
  EXPECT_LT(result.all.gradient_angle_mean_deg, 15.0);
  EXPECT_EQ(result.all.num_nan_gradients, 0u);
  EXPECT_GT(result.all.expected_error, 0.0);
}

TEST_F(EvaluateTest, BandsDivideTheSamplesByTrueDistance) {
  const Evaluation result = evaluate(directory_ / "a.gdfmap", options_);
  std::uint64_t sum = 0;
  for (const BandStatistics& band : result.bands) sum += band.errors.num_samples;
  EXPECT_EQ(sum, result.all.num_samples);
  // Thin bands, whose share of the space alone would be 50 and 250 samples.
  EXPECT_GT(result.bands[0].errors.num_samples, 120u);
  EXPECT_GT(result.bands[1].errors.num_samples, 600u);
  ASSERT_EQ(result.gradient_bands.size(), 2u);
  EXPECT_EQ(result.gradient_bands[0].min_distance, 0.1);
  EXPECT_GT(result.gradient_bands[0].errors.num_off_axis_gradients, 100u);
  EXPECT_LE(result.gradient_bands[0].errors.num_off_axis_gradients,
            result.gradient_bands[0].errors.num_gradients);
  EXPECT_GT(result.gradient_bands[0].errors.off_axis_angle_mean_deg, 0.0);
}

/// A weighted mean over equal shares of bands is that over the cubes' space.
TEST_F(EvaluateTest, StratifiedMeansAreThoseOfUniformSamples) {
  options_.num_samples = 40'000;
  const Evaluation stratified = evaluate(directory_ / "a.gdfmap", options_);
  options_.step = 0.05;
  const Evaluation regular = evaluate(directory_ / "a.gdfmap", options_);
  EXPECT_NEAR(stratified.outer_shell.mae / regular.outer_shell.mae, 1.0, 0.05);
  EXPECT_NEAR(stratified.populated.mae / regular.populated.mae, 1.0, 0.05);
  EXPECT_NEAR(stratified.all.mae / regular.all.mae, 1.0, 0.05);
  EXPECT_NEAR(stratified.all.p95 / regular.all.p95, 1.0, 0.1);
}

TEST_F(EvaluateTest, CountsWhatIsAnsweredOutsideTheCubes) {
  const Evaluation result = evaluate(directory_ / "a.gdfmap", options_);
  EXPECT_GT(result.beyond.num_far, 1000u);
  EXPECT_EQ(result.beyond.total(), result.beyond.num_far);
  EXPECT_EQ(result.answers.total(), result.levels.at(0).answers.total() + result.beyond.total());
  EXPECT_GT(result.stated_share, 0.0);
  EXPECT_LT(result.stated_share, 0.05);  // a ball of 3 m in one of 31 m
}

TEST_F(EvaluateTest, TheCubesOwnErrorIsThatWithoutBlending) {
  const Evaluation result = evaluate(directory_ / "a.gdfmap", options_);
  EXPECT_GT(result.populated.own_cube_mae, 0.0);
  EXPECT_NE(result.populated.own_cube_mae, result.populated.mae);
  // Held-out samples of the own cube are what the field states.
  EXPECT_NEAR(result.populated.own_cube_mae / result.populated.expected_error, 1.0, 0.3);
}

TEST_F(EvaluateTest, HandsOutEverySampleThatItJudged) {
  std::uint64_t num_samples = 0;
  double weight = 0.0, error = 0.0;
  options_.visit = [&](std::span<const JudgedSample> samples) {
    for (const JudgedSample& sample : samples) {
      ++num_samples;
      EXPECT_NEAR(sample.distance, std::abs(sample.p_world.norm() - 1.0), 0.1);
      if (sample.level != 0 || !sample.is_stated()) continue;
      weight += sample.weight;
      error += sample.weight * sample.error();
    }
  };
  const Evaluation result = evaluate(directory_ / "a.gdfmap", options_);
  EXPECT_EQ(num_samples, 5000u);
  EXPECT_NEAR(error / weight, result.all.mae, 1e-6);
}

TEST_F(EvaluateTest, ThreadsAndMemoryDoNotMatter) {
  const Evaluation one = evaluate(directory_ / "a.gdfmap", options_, {.num_threads = 1});
  const Evaluation two = evaluate(directory_ / "a.gdfmap", options_,
                                  {.num_threads = 2, .memory_bytes = kMinMemoryBytes});
  EXPECT_EQ(one.all.mae, two.all.mae);
  EXPECT_EQ(one.all.gradient_angle_mean_deg, two.all.gradient_angle_mean_deg);
  EXPECT_EQ(one.answers, two.answers);
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

TEST_F(EvaluateTest, RefusesMoreSamplesThanMemoryHolds) {
  options_.num_samples = 1'000'000;
  EXPECT_THROW(evaluate(directory_ / "a.gdfmap", options_, {.memory_bytes = kMinMemoryBytes}),
               Error);
}

/// Level 0 around a point at the origin, by hand, and cubes of coarser levels around it: each is
/// the distance to the point plus an error of its level.
class EvaluateLevelsTest : public testing::Test {
 protected:
  EvaluateLevelsTest() {
    test::write_cloud(directory_ / "a.ply", std::vector<Vector3>{{0.001, 0.001, 0.001}});
    Map map = Map::create(directory_ / "a.gdfmap", {1.0, kMarginRatio, 3});
    ingest(directory_ / "a.ply", map);
    std::vector<TileRecord> tiles;
    std::vector<OccupiedTile> occupied;
    map.points().for_each_tile([&](const TilePoints& tile) {
      occupied.push_back({tile.key, tile.cubes});
    });
    map.cubes().set_occupied(occupied);
    add_block(0, 2, 1.0f, tiles);
    add_block(1, 3, 5.0f, tiles);
    add_block(2, 3, 20.0f, tiles);
    map.cubes().put(tiles);
  }

  /// Cubes [-n, n)³ of a level that all say `distance`.
  static void add_block(int level, int n, float distance, std::vector<TileRecord>& tiles) {
    std::map<TileKey, TileRecord> by_key;
    for (int z = -n; z < n; ++z) {
      for (int y = -n; y < n; ++y) {
        for (int x = -n; x < n; ++x) {
          const CubeKey key{level, x, y, z};
          TileRecord& tile = by_key[tile_of(key)];
          tile.key = tile_of(key);
          CubeRecord cube;
          cube.index = cube_index_in_tile(key);
          cube.errors.mae = 0.5f;
          cube.gaussians = Gaussians(1);
          for (std::size_t a = 0; a < 3; ++a) cube.gaussians.at(kRootSigmaX + a, 0) = 300.0f;
          cube.gaussians.at(kWeight, 0) = distance;
          tile.cubes.push_back(cube);
        }
      }
    }
    for (auto& [key, tile] : by_key) {
      std::ranges::sort(tile.cubes, {}, &CubeRecord::index);
      tiles.push_back(tile);
    }
  }

  /// Mean error of the field over the cube of this half width without that of the inner one.
  [[nodiscard]] double mean_error(double inner, double outer) const {
    const DistanceField field(open_tile_source(directory_ / "a.gdfmap"));
    constexpr int n = 60;
    double sum = 0.0, count = 0.0;
    for (int i = 0; i < n * n * n; ++i) {
      const Vector3 place(i % n, i / n % n, i / (n * n));
      const Vector3 p = (2.0 * (place + Vector3::Constant(0.5)) / n - Vector3::Ones()) * outer;
      if (p.cwiseAbs().maxCoeff() < inner) continue;
      sum += std::abs(field.at(p).distance - p.norm());
      count += 1.0;
    }
    return sum / count;
  }

  test::TemporaryDirectory directory_;
};

TEST_F(EvaluateLevelsTest, JudgesEveryLevelWhereNoFinerOneHasCubes) {
  const Evaluation result = evaluate(directory_ / "a.gdfmap", {});
  ASSERT_EQ(result.levels.size(), 3u);
  EXPECT_EQ(result.answers.total(), 100'000u);
  EXPECT_EQ(result.answers.num_fine + result.answers.num_coarse + result.answers.num_far,
            result.answers.total());
  EXPECT_EQ(result.levels[0].level, 0);
  EXPECT_EQ(result.levels[0].errors.num_samples, result.all.num_samples);
  EXPECT_GT(result.levels[1].answers.num_coarse, 10'000u);
  EXPECT_EQ(result.levels[1].answers.num_fine, 0u);
  EXPECT_GT(result.levels[2].answers.num_coarse, 10'000u);
  EXPECT_NEAR(result.all.mae / mean_error(0.0, 2.0), 1.0, 0.02);
  EXPECT_NEAR(result.levels[1].errors.mae / mean_error(2.0, 12.0), 1.0, 0.02);
  EXPECT_NEAR(result.all.expected_error, 0.5, 1e-6);
}

TEST_F(EvaluateLevelsTest, FarBandsGetTheirShareOfSamples) {
  const Evaluation result = evaluate(directory_ / "a.gdfmap", {});
  // The first two hold a few samples alone around a single point.
  for (std::size_t i = 2; i < result.bands.size(); ++i) {
    EXPECT_GT(result.bands[i].errors.num_samples, 9'000u) << i;
  }
  EXPECT_GT(result.stated_share, 0.99);  // cubes reach 48 m
}

TEST_F(EvaluateLevelsTest, HolesWithinThirtyMetresAreSeen) {
  {
    Map map = Map::open(directory_ / "a.gdfmap", Access::kWrite);
    map.cubes().erase(std::vector<TileKey>{{2, 0, 0, 0}});
  }
  const Evaluation result = evaluate(directory_ / "a.gdfmap", {});
  EXPECT_GT(result.beyond.num_far, 1000u);
  EXPECT_LT(result.stated_share, 0.9);  // an octant but for level 1, and the margin around it
  EXPECT_GT(result.stated_share, 0.75);
}

}  // namespace
}  // namespace gdfmap
