#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/ingest.hpp>
#include <gdfmap/query/distance_field.hpp>
#include <gdfmap/train/train.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

/// The coarse levels are what is looked at.
TrainOptions quick_options() { return {test::quick_fit_config(), false}; }

/// A patch of ground and a pole.
std::vector<Vector3> small_scene() {
  std::vector<Vector3> points;
  for (int i = 0; i < 30; ++i) {
    for (int j = 0; j < 30; ++j) points.emplace_back(0.2 * i + 0.03, 0.2 * j + 0.05, 0.01);
  }
  for (int i = 0; i < 100; ++i) points.emplace_back(3.0, 3.0, 0.1 * i);
  return points;
}

double distance_to(std::span<const Vector3> points, const Vector3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const Vector3& q : points) best = std::min(best, (p - q).norm());
  return best;
}

std::int64_t num_cubes(Map& map, int level) {
  std::int64_t total = 0;
  map.cubes().for_each_state([&](const TileState& state) {
    if (state.key.level == level) total += state.num_cubes;
  });
  return total;
}

class LevelsTest : public testing::Test {
 protected:
  [[nodiscard]] Map new_map(const std::string& name, std::span<const Vector3> points,
                            int num_levels = kMaxLevels) const {
    return test::map_of(directory_ / name, points, 1.0, num_levels);
  }
  void add(Map& map, const std::string& name, std::span<const Vector3> points) const {
    test::write_cloud(directory_ / name, points);
    ingest(directory_ / name, map);
  }

  test::TemporaryDirectory directory_;
  const std::vector<Vector3> points_ = small_scene();
};

TEST_F(LevelsTest, AnswerEverywhereWithinThirtyMetresOfAPoint) {
  Map map = new_map("a.gdfmap", points_);
  train(map, quick_options());
  const DistanceField field(map);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(-60.0, 60.0);
  int num_near = 0, num_far = 0;
  double worst_ratio = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const Vector3 p(anywhere(random), anywhere(random), anywhere(random));
    const double truth = distance_to(points_, p);
    const FieldSample answer = field.at(p);
    if (truth > 30.0) {
      if (answer.status == FieldStatus::kFar) ++num_far;
      continue;
    }
    ++num_near;
    ASSERT_TRUE(answer.status == FieldStatus::kFine || answer.status == FieldStatus::kCoarse)
        << p.transpose() << ", " << truth << " m from a point";
    worst_ratio = std::max(worst_ratio, std::abs(answer.distance - truth) / truth);
  }
  EXPECT_GT(num_near, 300);
  EXPECT_GT(num_far, 500);
  EXPECT_LT(worst_ratio, 0.5) << "a coarse answer is near the truth, if not as near as a fine one";
}

TEST_F(LevelsTest, OneLevelHasNoCoarseCubes) {
  Map map = new_map("a.gdfmap", points_, 1);
  train(map, quick_options());
  EXPECT_GT(num_cubes(map, 0), 0);
  EXPECT_EQ(num_cubes(map, 1), 0);
}

TEST_F(LevelsTest, ASingleOccupiedCubeHasTheCoarseCubesOfItsSurroundings) {
  Map map = new_map("a.gdfmap", std::vector<Vector3>{{0.5, 0.5, 0.5}}, 2);
  train(map, quick_options());
  // Cubes of 4 m whose box, 1 m larger on each side, is within 8 m of [0, 1]³.
  std::int64_t expected = 0;
  for (int x = -5; x <= 5; ++x) {
    for (int y = -5; y <= 5; ++y) {
      for (int z = -5; z <= 5; ++z) {
        const auto gap = [](int k) {
          return std::max({4.0 * k - 1.0 - 1.0, 0.0 - (4.0 * k + 5.0), 0.0});
        };
        expected += Vector3(gap(x), gap(y), gap(z)).norm() <= 8.0;
      }
    }
  }
  EXPECT_EQ(num_cubes(map, 1), expected);
}

TEST_F(LevelsTest, CoarseCubesThatFinerOnesHideAreNotFitted) {
  std::vector<Vector3> block;  // a point in every cube of [-8, 16)³: finer cubes everywhere
  for (int i = 0; i < 24 * 24 * 24; ++i) {
    block.emplace_back(i % 24 - 7.5, i / 24 % 24 - 7.5, i / 576 - 7.5);
  }
  Map map = new_map("a.gdfmap", block, 2);
  train(map, quick_options());
  const auto tile = map.cubes().read({1, 0, 0, 0});
  ASSERT_TRUE(tile.has_value());
  const auto has = [&](int x, int y, int z) {
    return std::ranges::any_of(
        tile->cubes, [&](const CubeRecord& cube) { return cube.index == cube_index(x, y, z); });
  };
  EXPECT_FALSE(has(0, 0, 0)) << "[0, 4)³ and its margin are deep inside";
  EXPECT_TRUE(has(4, 0, 0)) << "finer cubes end at 18 m";
  // Nothing is missing where it is hidden.
  EXPECT_EQ(DistanceField(map).at({2.2, 2.1, 1.9}).status, FieldStatus::kFine);
}

TEST_F(LevelsTest, EveryPathToTheSamePointsGivesTheSameMap) {
  const std::span<const Vector3> all(points_);
  const std::vector<Vector3> far_away = {{70.0, 10.0, 3.0}, {70.5, 10.0, 3.0}};
  Map whole = new_map("whole.gdfmap", all);
  add(whole, "far.ply", far_away);
  train(whole, quick_options());
  const Digest digest = whole.cubes().content_digest();

  Map stepwise = new_map("steps.gdfmap", all.first(700));
  train(stepwise, quick_options());
  add(stepwise, "far2.ply", far_away);
  train(stepwise);
  add(stepwise, "rest.ply", all.subspan(700));
  const TrainReport report = train(stepwise);
  EXPECT_GT(report.num_cubes_out_of_reach, 0);
  EXPECT_EQ(stepwise.cubes().content_digest(), digest);

  Map shrunk = new_map("shrunk.gdfmap", all);
  add(shrunk, "wrong.ply", std::vector<Vector3>{{3.0, -20.0, 1.0}});
  add(shrunk, "far3.ply", far_away);
  train(shrunk, quick_options());
  EXPECT_NE(shrunk.cubes().content_digest(), digest);
  shrunk.points().remove(2);
  EXPECT_GT(train(shrunk).num_cubes_fitted, 0);
  EXPECT_EQ(shrunk.cubes().content_digest(), digest);
  EXPECT_EQ(train(shrunk).num_tiles_trained, 0);
}

TEST_F(LevelsTest, DoNotDependOnThreadsOrMemory) {
  RunContext one, many;
  one.num_threads = 1;
  one.memory_bytes = kMinMemoryBytes;
  many.num_threads = 4;
  many.memory_bytes = std::size_t{4} << 30;
  Map a = new_map("a.gdfmap", points_), b = new_map("b.gdfmap", points_);
  train(a, quick_options(), one);
  train(b, quick_options(), many);
  EXPECT_GT(num_cubes(a, 2), 0);
  EXPECT_EQ(a.cubes().content_digest(), b.cubes().content_digest());
}

TEST_F(LevelsTest, AreBuiltOnAMapThatHadBeenStoppedBeforeThem) {
  std::atomic<bool> stop = false;
  class StopAtLevelOne : public ReportSink {
   public:
    explicit StopAtLevelOne(std::atomic<bool>& stop) : stop_(stop) {}
    void on_progress(const Progress& progress) override {
      if (std::string(progress.stage) == "tiles of level 1") stop_ = true;
    }
    void on_message(Severity, const std::string&) override {}

   private:
    std::atomic<bool>& stop_;
  } sink(stop);
  RunContext context;
  context.sink = &sink;
  context.stop = &stop;
  context.memory_bytes = kMinMemoryBytes;  // windows of one tile
  Map map = new_map("a.gdfmap", points_);
  EXPECT_THROW(train(map, quick_options(), context), Error);
  EXPECT_GT(num_cubes(map, 1), 0);
  EXPECT_EQ(num_cubes(map, 2), 0);
  train(map);
  Map at_once = new_map("b.gdfmap", points_);
  train(at_once, quick_options());
  EXPECT_EQ(map.cubes().content_digest(), at_once.cubes().content_digest());
}

}  // namespace
}  // namespace gdfmap
