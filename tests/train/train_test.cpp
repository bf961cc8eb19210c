#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/ingest.hpp>
#include <gdfmap/query/distance_field.hpp>
#include <gdfmap/train/exact_distance.hpp>
#include <gdfmap/train/train.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

TrainOptions quick_options() {
  FitConfig config = test::quick_fit_config();
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

/// More points in a tile than can be indexed at once with the least memory.
std::vector<Vector3> dense_points() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> within(0.1, 2.9);
  std::vector<Vector3> points(1'300'000);
  for (Vector3& p : points) {
    const double x = within(random), y = within(random), z = within(random);
    p = {x, y, 0.5 + 0.1 * z};
  }
  return points;
}

TEST_F(TrainTest, DoesNotDependOnThreadsOrMemory) {
  RunContext one, many;
  one.num_threads = 1;
  one.memory_bytes = kMinMemoryBytes;
  many.num_threads = 4;
  many.memory_bytes = std::size_t{4} << 30;
  for (const bool is_dense : {false, true}) {
    const std::vector<Vector3> points = is_dense ? dense_points() : box_;
    const std::string name = is_dense ? "dense" : "box";
    Map a = new_map(name + "_a.gdfmap", points), b = new_map(name + "_b.gdfmap", points);
    EXPECT_GT(train(a, quick_options(), one).num_cubes_fitted, 20);
    train(b, quick_options(), many);
    EXPECT_EQ(a.cubes().content_digest(), b.cubes().content_digest());
  }
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

/// The input digest of every stored cube, and of each cube's tile and index.
std::map<std::pair<TileKey, int>, std::uint64_t> inputs_of(Map& map) {
  std::map<std::pair<TileKey, int>, std::uint64_t> inputs;
  std::vector<TileKey> keys;
  map.cubes().for_each_state([&](const TileState& state) { keys.push_back(state.key); });
  for (const TileKey& key : keys) {
    const auto tile = map.cubes().read(key);
    for (const CubeRecord& cube : tile.value().cubes) inputs[{key, cube.index}] = cube.input;
  }
  return inputs;
}

TEST_F(TrainTest, CountsAsFittedExactlyTheCubesWhoseInputsChanged) {
  Map map = new_map("a.gdfmap", box_);
  train(map, quick_options());
  const auto before = inputs_of(map);
  add(map, "more.ply", {box_[0] + Vector3(0.2, 0.1, 0.15)});
  const TrainReport report = train(map);
  std::int64_t num_changed = 0;
  const auto after = inputs_of(map);
  for (const auto& [cube, input] : after) {
    const auto former = before.find(cube);
    num_changed += former == before.end() || former->second != input;
  }
  EXPECT_GT(num_changed, 0);
  EXPECT_LT(num_changed, static_cast<std::int64_t>(after.size()) / 2);
  EXPECT_EQ(report.num_cubes_fitted, num_changed);
}

/// Points of a box, moved by `offset`.
std::vector<Vector3> moved(std::span<const Vector3> points, const Vector3& offset) {
  std::vector<Vector3> result;
  for (const Vector3& p : points) result.push_back(p + offset);
  return result;
}

TEST_F(TrainTest, CubesThatNoAddedScanReachesAreNotLookedAt) {
  Map map = new_map("a.gdfmap", box_);
  add(map, "beside.ply", moved(box_, {20.0, 0.0, 0.0}));
  train(map, quick_options());
  const auto before = inputs_of(map);
  // Two scans between two runs, of the corner of one box.
  add(map, "corner.ply", {box_[0] + Vector3(0.2, 0.1, 0.15)});
  add(map, "corner2.ply", {box_[0] + Vector3(0.1, 0.2, 0.15)});
  const TrainReport report = train(map);
  EXPECT_GT(report.num_cubes_fitted, 0);
  EXPECT_GT(report.num_cubes_out_of_reach, 3 * report.num_cubes_fitted);

  Map at_once = new_map("b.gdfmap", box_);
  add(at_once, "all.ply", moved(box_, {20.0, 0.0, 0.0}));
  add(at_once, "corner3.ply",
      {box_[0] + Vector3(0.2, 0.1, 0.15), box_[0] + Vector3(0.1, 0.2, 0.15)});
  train(at_once, quick_options());
  EXPECT_EQ(map.cubes().content_digest(), at_once.cubes().content_digest());
  EXPECT_EQ(inputs_of(map), inputs_of(at_once));
}

TEST_F(TrainTest, AScanThatThinsOutPointsOfItsVoxelsIsFeltBesideItsCubes) {
  const auto add_thinned = [&](Map& map, const std::string& name, std::span<const Vector3> points) {
    test::write_cloud(directory_ / name, points);
    IngestOptions options;
    options.voxel_size = 0.95;
    ingest(directory_ / name, map, options);
  };
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(0.0, 8.0);
  for (int round = 0; round < 4; ++round) {
    std::vector<Vector3> points;
    for (int i = 0; i < 300; ++i) {
      points.emplace_back(anywhere(random), anywhere(random), 0.2 * anywhere(random));
    }
    const std::string name = std::to_string(round);
    Map stepwise = open_or_create_map(directory_ / (name + "s.gdfmap"), {1.0, 1});
    add_thinned(stepwise, name + "a.ply", std::span(points).first(200));
    train(stepwise, quick_options());
    for (int i = 200; i < 205; ++i) {
      add_thinned(stepwise, name + std::to_string(i) + ".ply",
                  std::span(points).subspan(static_cast<std::size_t>(i), 1));
    }
    train(stepwise);
    Map at_once = open_or_create_map(directory_ / (name + "o.gdfmap"), {1.0, 1});
    add_thinned(at_once, name + "b.ply", std::span(points).first(205));
    train(at_once, quick_options());
    EXPECT_EQ(stepwise.cubes().content_digest(), at_once.cubes().content_digest()) << round;
  }
}

TEST_F(TrainTest, AfterASourceWentTheMapIsAsIfItHadNeverBeen) {
  Map map = new_map("a.gdfmap", box_);
  train(map, quick_options());
  const Digest digest = map.cubes().content_digest();
  add(map, "b.ply", moved(box_, {0.3, 0.2, 0.4}));
  add(map, "c.ply", moved(box_, {5.0, 5.0, 0.0}));
  train(map);
  for (const SourceRecord& source : map.points().sources()) {
    if (source.id > 1) map.points().remove(source.id);
  }
  train(map);
  EXPECT_EQ(map.cubes().content_digest(), digest);
}

/// Runs SQL on the cubes of a map that nobody has open.
void tamper(const std::filesystem::path& map, const std::string& sql) {
  db::Database(map / "cubes.db", db::OpenMode::kWrite).execute(sql);
}

TEST_F(TrainTest, RebuildsWhateverOfItsTilesIsDamagedAndNothingElse) {
  const auto path = directory_ / "a.gdfmap";
  std::int64_t num_cubes = 0;
  Digest digest;
  {
    Map map = new_map("a.gdfmap", box_);
    train(map, quick_options());
    num_cubes = map.cubes().totals().num_cubes;
    digest = map.cubes().content_digest();
  }
  const std::string tile = " = (SELECT id FROM tiles WHERE num_cubes > 20 LIMIT 1)";
  const std::vector<std::string> damages = {
      "UPDATE tile_blobs SET data = zeroblob(length(data)) WHERE tile" + tile,
      "UPDATE tiles SET content = zeroblob(16) WHERE id" + tile,
      "UPDATE tiles SET num_poor = num_poor + 1 WHERE id" + tile,
      "UPDATE tiles SET num_cubes = 100000 WHERE id" + tile,
      "UPDATE tiles SET mean_mae = 0.5 WHERE id" + tile,
      "UPDATE tiles SET checksum = checksum + 1 WHERE id" + tile,
      "DELETE FROM tile_blobs WHERE tile" + tile,
      "DELETE FROM tiles WHERE id" + tile,
      "DELETE FROM tiles; DELETE FROM tile_blobs",
      "PRAGMA ignore_check_constraints = 1; UPDATE occupied SET mask = x'00'",
      "DELETE FROM occupied"};
  for (const std::string& damage : damages) {
    SCOPED_TRACE(damage);
    tamper(path, damage);
    Map map = Map::open(path, Access::kWrite);
    EXPECT_LE(train(map).num_cubes_fitted, num_cubes);
    EXPECT_EQ(map.cubes().content_digest(), digest);
    EXPECT_EQ(map.cubes().totals().num_cubes, num_cubes);
    EXPECT_EQ(map.cubes().verify(true), std::vector<std::string>{});
    EXPECT_FALSE(map.cubes().occupied().empty());
  }
}

TEST_F(TrainTest, TellsADamagedTileAndFitsItAlone) {
  {
    Map map = new_map("a.gdfmap", {{0.5, 0.5, 0.5}, {100.5, 0.5, 0.5}});
    train(map, quick_options());
  }
  tamper(directory_ / "a.gdfmap",
         "UPDATE tile_blobs SET data = zeroblob(length(data)) "
         "WHERE tile = (SELECT id FROM tiles WHERE x = 12 AND y = 0 AND z = 0)");
  class Warnings : public ReportSink {
   public:
    void on_progress(const Progress&) override {}
    void on_message(Severity, const std::string& message) override { text += message + "\n"; }
    std::string text;
  } warnings;
  RunContext context;
  context.sink = &warnings;
  Map map = Map::open(directory_ / "a.gdfmap", Access::kWrite);
  const TrainReport report = train(map, {}, context);
  EXPECT_EQ(report.num_tiles_damaged, 1);
  EXPECT_EQ(report.num_tiles_trained, 1);
  EXPECT_GT(report.num_cubes_fitted, 0);
  EXPECT_LE(report.num_cubes_fitted, 7);
  EXPECT_NE(warnings.text.find("tile 0,12,0,0: checksum"), std::string::npos) << warnings.text;
}

TEST_F(TrainTest, AnInterruptedRetrainIsContinuedByAPlainRun) {
  TrainOptions other = quick_options();
  other.config->max_iterations = 4;
  other.retrain = true;
  Map whole = new_map("whole.gdfmap", box_), map = new_map("a.gdfmap", box_);
  train(whole, other);
  train(map, quick_options());
  const std::atomic<bool> stop = true;
  RunContext context;
  context.stop = &stop;
  EXPECT_THROW(train(map, other, context), Error);
  EXPECT_GT(train(map).num_cubes_fitted, 0);
  EXPECT_EQ(map.cubes().content_digest(), whole.cubes().content_digest());
}

TEST_F(TrainTest, PointsThatWentTakeTheirTilesAndNothingElse) {
  Map whole = new_map("whole.gdfmap", {{0.5, 0.5, 0.5}});
  train(whole, quick_options());
  Map map = new_map("a.gdfmap", {{0.5, 0.5, 0.5}});
  add(map, "far.ply", {{100.5, 0.5, 0.5}});
  train(map, quick_options());
  map.points().remove(map.points().sources().back().id);
  const TrainReport report = train(map);
  EXPECT_GT(report.num_tiles_deleted, 0);
  EXPECT_EQ(report.num_cubes_fitted, 0);
  EXPECT_EQ(map.cubes().content_digest(), whole.cubes().content_digest());
  EXPECT_EQ(map.cubes().occupied(), whole.cubes().occupied());
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

/// Asks a field of its own, opened anew between commits, at the same places.
class ReaderBeside : public ReportSink {
 public:
  ReaderBeside(std::filesystem::path map, std::span<const Vector3> places)
      : map_(std::move(map)), places_(places) {}
  void on_progress(const Progress&) override { answers.push_back(ask()); }
  void on_message(Severity, const std::string&) override {}
  [[nodiscard]] std::vector<FieldSample> ask() const {
    std::vector<FieldSample> samples(places_.size());
    DistanceField(Map::open(map_, Access::kRead)).at(places_, samples);
    return samples;
  }
  std::vector<std::vector<FieldSample>> answers;

 private:
  std::filesystem::path map_;
  std::span<const Vector3> places_;
};

TEST_F(TrainTest, AReaderBesideItGetsTheFinalAnswerOrNone) {
  Map map = new_map("a.gdfmap", box_);
  ReaderBeside reader(map.path(), std::span(box_).first(200));
  RunContext context;
  context.sink = &reader;
  context.memory_bytes = kMinMemoryBytes;  // one tile a commit
  train(map, quick_options(), context);
  const std::vector<FieldSample> final_answers = reader.ask();
  ASSERT_GT(reader.answers.size(), 5u);
  std::size_t num_unknown = 0, num_fine = 0;
  for (const auto& answers : reader.answers) {
    for (std::size_t i = 0; i < answers.size(); ++i) {
      num_unknown += answers[i].status == FieldStatus::kUnknown;
      if (answers[i].status != FieldStatus::kFine) continue;
      ++num_fine;
      EXPECT_EQ(answers[i].distance, final_answers[i].distance);
    }
  }
  EXPECT_GT(num_unknown, 0u);
  EXPECT_GT(num_fine, 0u);
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
