// A field beside its map: tiles on their way, tiles that change.
#include <cmath>
#include <cstring>
#include <filesystem>
#include <thread>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/query/distance_field.hpp>

#include "field_builder.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

using test::constant_gaussians;
using test::FieldBuilder;
using test::random_block;

std::vector<Vector3> points_in_the_block() {
  std::mt19937 random(51);
  std::uniform_real_distribution<double> uniform(-3.0, 3.0);
  std::vector<Vector3> points(500);
  for (Vector3& p : points) p = {uniform(random), uniform(random), uniform(random)};
  return points;
}

std::size_t num_pending(const std::vector<FieldSample>& samples) {
  return static_cast<std::size_t>(
      std::ranges::count(samples, FieldStatus::kPending, &FieldSample::status));
}

TEST(TryAt, AnswersPendingAtOnceAndAsAtDoesOnceTheTilesAreThere) {
  for (const BlendMode blend : {BlendMode::kPartition, BlendMode::kGdf1}) {
    const FieldBuilder builder = random_block(2, 0.3, 5);
    const DistanceField field(builder.source(), {.blend = blend});
    const std::vector<Vector3> points = points_in_the_block();
    std::vector<FieldSample> samples(points.size()), expected(points.size());
    field.try_at(points, samples);
    while (num_pending(samples) > 0) {
      for (const FieldSample& sample : samples) {
        ASSERT_EQ(sample.status == FieldStatus::kPending || sample.status == FieldStatus::kUnknown,
                  std::isnan(sample.distance));
      }
      std::this_thread::yield();
      field.try_at(points, samples);
    }
    DistanceField(builder.source(), {.blend = blend}).at(points, expected);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_EQ(samples[i].status, expected[i].status);
      if (samples[i].status == FieldStatus::kUnknown) continue;
      ASSERT_EQ(samples[i].distance, expected[i].distance);
      ASSERT_EQ(samples[i].gradient, expected[i].gradient);
    }
  }
}

TEST(TryAt, NeverWaitsForTheSource) {
  /// A disk that gives nothing until it is told to.
  class StuckSource : public MemoryTileSource {
   public:
    explicit StuckSource(const FieldBuilder& builder)
        : MemoryTileSource(builder.geometry(), builder.tiles(), builder.occupied()) {}
    std::optional<TileRecord> load(const TileKey& key) override {
      is_free.wait(false);
      return MemoryTileSource::load(key);
    }
    std::atomic<bool> is_free = false;
  };
  const auto source = std::make_shared<StuckSource>(random_block(1, 0.0, 5));
  const DistanceField field(source);
  const std::vector<Vector3> points = points_in_the_block();
  std::vector<FieldSample> samples(points.size());
  field.try_at(points, samples);
  EXPECT_EQ(num_pending(samples), points.size());
  source->is_free = true;
  source->is_free.notify_all();
  while (num_pending(samples) > 0) field.try_at(points, samples);
  EXPECT_EQ(samples[0].status, FieldStatus::kFine);
}

TEST(Prefetch, LoadsWhatTheAnswersWant) {
  const FieldBuilder builder = random_block(2, 0.3, 5);
  const DistanceField field(builder.source());
  const std::vector<Vector3> points = points_in_the_block();
  field.prefetch(points);
  // Eight tiles of each level meet at the origin.
  while (field.statistics().num_tiles < 16) std::this_thread::yield();
  const auto before = field.statistics();
  std::vector<FieldSample> samples(points.size());
  field.at(points, samples);
  EXPECT_EQ(field.statistics().loads, before.loads);
  EXPECT_EQ(field.statistics().misses, before.misses);
  EXPECT_GT(field.statistics().hit_rate(), 0.0);
}

TEST(Prefetch, MayBeLeftBehind) {
  const std::vector<Vector3> points = points_in_the_block();
  for (int i = 0; i < 20; ++i) DistanceField(random_block(1, 0.0, 5).source()).prefetch(points);
}

class Refresh : public ::testing::Test {
 protected:
  Refresh() : store_(path(), db::OpenMode::kCreate) {
    builder_.add({0, 0, 0, 0}, constant_gaussians(1.0f))
        .add({0, 8, 0, 0}, constant_gaussians(2.0f))
        .occupy({0, 0, 0, 0})
        .occupy({0, 8, 0, 0});
    publish();
  }
  [[nodiscard]] std::filesystem::path path() const { return directory_ / "cubes.db"; }
  void publish() {
    store_.put(builder_.tiles());
    store_.set_occupied(builder_.occupied());
  }
  [[nodiscard]] std::shared_ptr<TileSource> source() const {
    return std::make_shared<StoreTileSource>(path(), builder_.geometry());
  }

  test::TemporaryDirectory directory_;
  FieldBuilder builder_{{}};
  CubeStore store_;
};

TEST_F(Refresh, AFieldKeepsWhatItLoadedUntilItIsRefreshed) {
  DistanceField field(source());
  const Vector3 p(0.5, 0.5, 0.5), other(8.5, 0.5, 0.5);
  EXPECT_NEAR(field.at(p).distance, 1.0, 1e-6);
  EXPECT_NEAR(field.at(other).distance, 2.0, 1e-6);
  builder_.add({0, 0, 0, 0}, constant_gaussians(3.0f));
  publish();
  EXPECT_NEAR(field.at(p).distance, 1.0, 1e-6);
  EXPECT_EQ(field.refresh(), 1u);
  EXPECT_NEAR(field.at(p).distance, 3.0, 1e-6);
  const auto loads = field.statistics().loads;
  EXPECT_NEAR(field.at(other).distance, 2.0, 1e-6);
  EXPECT_EQ(field.statistics().loads, loads);  // the tile beside it had not changed
  EXPECT_EQ(field.refresh(), 0u);
}

TEST_F(Refresh, SeesTilesThatCameAndWent) {
  DistanceField field(source());
  const Vector3 p(0.5, 0.5, 0.5), later(16.5, 0.5, 0.5);
  EXPECT_EQ(field.at(p).status, FieldStatus::kFine);
  EXPECT_EQ(field.at(later).status, FieldStatus::kFar);
  builder_.add({0, 16, 0, 0}, constant_gaussians(4.0f)).occupy({0, 16, 0, 0});
  publish();
  const TileKey gone{0, 0, 0, 0};
  store_.erase(std::span(&gone, 1));
  EXPECT_EQ(field.refresh(), 2u);
  EXPECT_EQ(field.at(later).status, FieldStatus::kFine);
  EXPECT_EQ(field.at(p).status, FieldStatus::kUnknown);  // still occupied, without its cubes
}

TEST_F(Refresh, SeesNewOccupiedCubes) {
  DistanceField field(source());
  const Vector3 p(0.5, 100.5, 0.5);
  EXPECT_NEAR(field.at(p).distance, 99.5, 1e-9);
  builder_.occupy({0, 0, 90, 0});
  publish();
  EXPECT_NEAR(field.at(p).distance, 99.5, 1e-9);
  field.refresh();
  EXPECT_NEAR(field.at(p).distance, 9.5, 1e-9);
}

TEST_F(Refresh, TriesUnreadableTilesAgain) {
  db::Database(path(), db::OpenMode::kWrite).execute("UPDATE tile_blobs SET data = zeroblob(100)");
  DistanceField field(source());
  EXPECT_EQ(field.at({0.5, 0.5, 0.5}).status, FieldStatus::kUnknown);
  publish();  // the same cubes again
  EXPECT_EQ(field.refresh(), 1u);
  EXPECT_EQ(field.at({0.5, 0.5, 0.5}).status, FieldStatus::kFine);
}

TEST_F(Refresh, MayRunBesideQueries) {
  DistanceField field(source(), {.num_threads = 1});
  std::atomic<bool> ends = false;
  std::thread reader([&] {
    const std::vector<Vector3> points(200, Vector3(0.5, 0.5, 0.5));
    std::vector<FieldSample> samples(points.size());
    while (!ends) {
      field.at(points, samples);
      const double distance = field.at({0.5, 0.5, 0.5}).distance;
      EXPECT_NEAR(distance, std::round(distance), 1e-5);
    }
  });
  for (int i = 0; i < 20; ++i) {
    builder_.add({0, 0, 0, 0}, constant_gaussians(static_cast<float>(i)));
    publish();
    field.refresh();
    EXPECT_NEAR(field.at({0.5, 0.5, 0.5}).distance, i, 1e-5);
  }
  ends = true;
  reader.join();
}

}  // namespace
}  // namespace gdfmap
