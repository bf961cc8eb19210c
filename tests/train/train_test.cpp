#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/ingest.hpp>
#include <gdfmap/train/exact_distance.hpp>
#include <gdfmap/train/train.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

/// Few and quick cubes: what is trained, not how well, is looked at here.
TrainOptions quick_options() {
  FitConfig config;
  config.populated_steps = {8};
  config.empty_steps = {4};
  config.max_iterations = 3;
  config.empty_distance_threshold = 1.0;
  return {config, false};
}

class TrainTest : public testing::Test {
 protected:
  [[nodiscard]] Map new_map(const std::string& name, const std::vector<Vector3>& points) const {
    return test::map_of(directory_ / name, points);
  }
  IngestReport add(Map& map, const std::string& name, const std::vector<Vector3>& points) const {
    test::write_cloud(directory_ / name, points);
    return ingest(directory_ / name, map);
  }

  test::TemporaryDirectory directory_;
  const std::vector<Vector3> box_ = test::scene_points("box", 4000);
};

TEST_F(TrainTest, FitsPopulatedCubesAndThoseNearThem) {
  Map map = new_map("a.gdfmap", {{0.5, 0.5, 0.5}});
  const TrainReport report = train(map, quick_options());
  // Centres within 1 m of a point in a cube's centre: the cube and its six neighbours.
  EXPECT_EQ(report.num_cubes_fitted, 7);
  EXPECT_EQ(report.num_cubes_failed, 0);
  const CubeTotals totals = map.cubes().totals();
  EXPECT_EQ(totals.num_cubes, 7);
  EXPECT_EQ(totals.num_populated, 1);
}

TEST_F(TrainTest, SelectsCubesByTheExactDistanceOfTheirCentre) {
  Map map = new_map("a.gdfmap", box_);
  const TrainOptions options = quick_options();
  train(map, options);
  std::vector<TilePoints> tiles;
  map.points().for_each_tile([&](const TilePoints& tile) { tiles.push_back(tile); });
  ExactDistance exact(map.points(), tiles, 1 << 24);
  for (int x = -9; x < 9; ++x) {
    for (int y = -9; y < 9; ++y) {
      for (int z = -3; z < 9; ++z) {
        const CubeKey cube{0, x, y, z};
        const std::vector<Eigen::Vector3i> centre = {
            {x * 8192 + 4096, y * 8192 + 4096, z * 8192 + 4096}};
        const double distance =
            exact.nearest({0, 0, 0}, centre, SampleOrder::kScattered)[0] * map.lattice().step();
        const auto tile = map.cubes().read(tile_of(cube));
        const int index = cube_index_in_tile(cube);
        const bool stored = tile && std::any_of(tile->cubes.begin(), tile->cubes.end(),
                                                [&](const auto& c) { return c.index == index; });
        const auto points = map.points().find_tile(tile_of(cube));
        const bool populated = points && points->cubes.test(index);
        EXPECT_EQ(stored, populated || distance <= 1.0) << x << " " << y << " " << z;
      }
    }
  }
}

TEST_F(TrainTest, ASecondRunFindsNothingToDo) {
  Map map = new_map("a.gdfmap", box_);
  train(map, quick_options());
  const Digest digest = map.cubes().content_digest();
  const TrainReport report = train(map);
  EXPECT_EQ(report.num_tiles_trained, 0);
  EXPECT_EQ(report.num_cubes_fitted, 0);
  EXPECT_EQ(map.cubes().content_digest(), digest);
}

TEST_F(TrainTest, DoesNotDependOnThreadsOrMemory) {
  RunContext one, many;
  one.num_threads = 1;
  one.memory_bytes = kMinMemoryBytes;
  many.num_threads = 4;
  many.memory_bytes = std::size_t{4} << 30;
  Map a = new_map("a.gdfmap", box_), b = new_map("b.gdfmap", box_);
  train(a, quick_options(), one);
  train(b, quick_options(), many);
  EXPECT_EQ(a.cubes().content_digest(), b.cubes().content_digest());
}

TEST_F(TrainTest, DoesNotDependOnTheOrderOfPoints) {
  std::vector<Vector3> shuffled = box_;
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(1));
  Map a = new_map("a.gdfmap", box_), b = new_map("b.gdfmap", shuffled);
  train(a, quick_options());
  train(b, quick_options());
  EXPECT_EQ(a.cubes().content_digest(), b.cubes().content_digest());
}

TEST_F(TrainTest, EveryPathToTheSamePointsGivesTheSameMap) {
  const auto middle = box_.begin() + 2000;
  const std::vector<Vector3> first(box_.begin(), middle), second(middle, box_.end());
  Map whole = new_map("whole.gdfmap", box_);
  train(whole, quick_options());

  Map stepwise = new_map("ab.gdfmap", first);
  train(stepwise, quick_options());
  add(stepwise, "second.ply", second);
  const TrainReport report = train(stepwise);
  EXPECT_GT(report.num_cubes_fitted, 0);

  Map reversed = new_map("ba.gdfmap", second);
  add(reversed, "first.ply", first);
  train(reversed, quick_options());

  EXPECT_EQ(stepwise.cubes().content_digest(), whole.cubes().content_digest());
  EXPECT_EQ(reversed.cubes().content_digest(), whole.cubes().content_digest());
}

TEST_F(TrainTest, FitsOnlyCubesWhoseInputsChanged) {
  Map map = new_map("a.gdfmap", {{0.5, 0.5, 0.5}, {6.5, 0.5, 0.5}});
  train(map, quick_options());
  // Two metres above the first point: its surroundings change, the other point's do not.
  add(map, "more.ply", {{0.5, 0.5, 2.5}});
  const TrainReport report = train(map);
  EXPECT_GT(report.num_cubes_fitted, 0);
  EXPECT_GE(report.num_cubes_unchanged, 7);
}

TEST_F(TrainTest, ADuplicateOfAPointChangesNoCube) {
  Map map = new_map("a.gdfmap", box_);
  train(map, quick_options());
  const Digest digest = map.cubes().content_digest();
  add(map, "again.ply", {box_.begin(), box_.begin() + 100});
  EXPECT_EQ(train(map).num_cubes_fitted, 0);
  EXPECT_EQ(map.cubes().content_digest(), digest);
}

TEST_F(TrainTest, RefusesAnotherConfigurationWithoutRetrain) {
  Map map = new_map("a.gdfmap", {{0.5, 0.5, 0.5}});
  train(map, quick_options());
  TrainOptions other = quick_options();
  other.config->max_iterations = 4;
  try {
    train(map, other);
    FAIL() << "another configuration was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kUsage);
    EXPECT_NE(std::string(error.what()).find("solver.max_iterations"), std::string::npos);
  }
  other.retrain = true;
  EXPECT_EQ(train(map, other).num_cubes_fitted, 7);
  EXPECT_EQ(train(map).num_cubes_fitted, 0);
}

/// Asks for a stop when a dozen windows are done.
class StopAtProgress : public ReportSink {
 public:
  void on_progress(const Progress& progress) override { stop = progress.done >= 12; }
  void on_message(Severity, const std::string&) override {}
  std::atomic<bool> stop = false;
};

TEST_F(TrainTest, InterruptedItKeepsWhatIsFinishedAndGoesOn) {
  // Three places far apart, so that there are several windows at the least memory.
  std::vector<Vector3> points;
  for (int i = 0; i < 40; ++i) points.emplace_back(40.5 * i, 4.5, 4.5);
  Map whole = new_map("whole.gdfmap", points), map = new_map("a.gdfmap", points);
  train(whole, quick_options());

  StopAtProgress sink;
  RunContext context;
  context.sink = &sink;
  context.stop = &sink.stop;
  context.memory_bytes = kMinMemoryBytes;
  EXPECT_THROW(train(map, quick_options(), context), Error);
  const std::int64_t num_cubes = map.cubes().totals().num_cubes;
  EXPECT_GT(num_cubes, 0);
  EXPECT_LT(num_cubes, whole.cubes().totals().num_cubes);
  train(map);
  EXPECT_EQ(map.cubes().content_digest(), whole.cubes().content_digest());
}

TEST_F(TrainTest, AnEmptyMapTrainsToNothing) {
  Map map = Map::create(directory_ / "empty.gdfmap");
  const TrainReport report = train(map, quick_options());
  EXPECT_EQ(report.num_tiles, 0);
  EXPECT_EQ(map.cubes().totals().num_tiles, 0);
}

TEST_F(TrainTest, ErrorsStatedAreThoseOfTheField) {
  Map map = new_map("a.gdfmap", box_);
  train(map, {FitConfig{}, false});
  const CubeTotals totals = map.cubes().totals();
  EXPECT_GT(totals.num_populated, 0);
  EXPECT_LT(totals.mean_mae, 0.02);
  EXPECT_GT(totals.mean_mae, 0.0);
}

}  // namespace
}  // namespace gdfmap
