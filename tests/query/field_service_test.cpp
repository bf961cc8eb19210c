// How a field serves: batches, threads, small caches, damaged tiles.
#include <cstring>
#include <filesystem>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/db/database.hpp>
#include <gdfmap/query/distance_field.hpp>

#include "field_builder.hpp"

namespace gdfmap {
namespace {

using test::FieldBuilder;
using test::random_block;

std::vector<Vector3> random_points(std::size_t count, double extent) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> uniform(-extent, extent);
  std::vector<Vector3> points(count);
  for (Vector3& p : points) p = {uniform(random), uniform(random), uniform(random)};
  points[count / 2].x() = std::numeric_limits<double>::quiet_NaN();
  return points;
}

std::vector<FieldSample> answers(const FieldBuilder& builder, const std::vector<Vector3>& points,
                                 const DistanceFieldOptions& options) {
  const DistanceField field(builder.source(), options);
  std::vector<FieldSample> samples(points.size());
  field.at(points, samples);
  return samples;
}

/// To the last bit; NaN equals NaN.
bool identical(const FieldSample& a, const FieldSample& b) {
  const auto same = [](double x, double y) { return std::memcmp(&x, &y, sizeof(x)) == 0; };
  return same(a.distance, b.distance) && same(a.gradient.x(), b.gradient.x()) &&
         same(a.gradient.y(), b.gradient.y()) && same(a.gradient.z(), b.gradient.z()) &&
         a.status == b.status && same(a.expected_error, b.expected_error);
}

void expect_identical(const std::vector<FieldSample>& a, const std::vector<FieldSample>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_TRUE(identical(a[i], b[i])) << i;
}

TEST(DistanceFieldService, ABatchAnswersAsSinglePointsDo) {
  for (const BlendMode blend : {BlendMode::kPartition, BlendMode::kGdf1}) {
    const FieldBuilder builder = random_block(2, 0.3, 3);
    const std::vector<Vector3> points = random_points(6000, 12.0);
    const DistanceField field(builder.source(), {.blend = blend});
    std::vector<FieldSample> single;
    for (const Vector3& p : points) single.push_back(field.at(p));
    expect_identical(single, answers(builder, points, {.blend = blend, .num_threads = 3}));
    expect_identical(single, answers(builder, points, {.blend = blend, .num_threads = 1}));
  }
}

TEST(DistanceFieldService, TheCacheChangesNoAnswer) {
  const FieldBuilder builder = random_block(2, 0.3, 3);
  const std::vector<Vector3> points = random_points(6000, 12.0);
  const std::vector<FieldSample> unlimited =
      answers(builder, points, {.cache_bytes = std::size_t{1} << 30});
  const std::size_t one_tile = DecodedTile(builder.tiles()[0]).num_bytes() + 1000;
  expect_identical(unlimited, answers(builder, points, {.cache_bytes = one_tile}));
  expect_identical(unlimited, answers(builder, points, {.cache_bytes = 0}));
}

TEST(DistanceFieldService, ABatchFetchesEachTileAFewTimesHoweverItIsOrdered) {
  FieldBuilder builder({1.0, 0.25, 1});
  std::mt19937 random(1);
  for (int x = 0; x < 10; ++x) {
    for (int y = 0; y < 10; ++y) {
      builder.add({0, 8 * x, 8 * y, 0}, test::random_gaussians(2, 1.0, random));
    }
  }
  std::uniform_real_distribution<double> uniform(0.0, 80.0), height(1.0, 7.0);
  std::vector<Vector3> points(20000);
  for (Vector3& p : points) p = {uniform(random), uniform(random), height(random)};
  const DistanceField field(builder.source(), {.cache_bytes = 0, .num_threads = 1});
  std::vector<FieldSample> samples(points.size());
  field.at(points, samples);
  EXPECT_LT(field.statistics().loads, 1000u);  // in the given order it would be about 20000
}

TEST(DistanceFieldService, AnswersAnEmptyBatchAndRefusesOneWithoutRoom) {
  const DistanceField field(random_block(1, 0.0, 1).source());
  field.at({}, {});
  std::vector<Vector3> points(3, Vector3::Zero());
  std::vector<FieldSample> samples(2);
  try {
    field.at(points, samples);
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kUsage);
  }
}

TEST(DistanceFieldService, CanBeMoved) {
  DistanceField field(random_block(1, 0.0, 1).source());
  const FieldSample before = field.at({0.5, 0.5, 0.5});
  const DistanceField moved = std::move(field);
  EXPECT_TRUE(identical(before, moved.at({0.5, 0.5, 0.5})));
}

class DamagedMapTest : public ::testing::Test {
 protected:
  void SetUp() override {
    directory_ = std::filesystem::path(::testing::TempDir()) /
                 (std::string("damaged_map_") +
                  ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(directory_);
    std::filesystem::create_directories(directory_);
    path_ = directory_ / "cubes.db";
    CubeStore store(path_, db::OpenMode::kCreate);
    store.put(builder_.tiles());
    store.set_occupied(builder_.occupied());
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  /// Spoils the level-0 tile at the origin.
  void damage() {
    db::Database(path_, db::OpenMode::kWrite)
        .execute(
            "UPDATE tile_blobs SET data = zeroblob(100) WHERE tile = (SELECT id FROM tiles "
            "WHERE level = 0 AND x = 0 AND y = 0 AND z = 0)");
  }

  FieldBuilder builder_ = random_block(2, 0.0, 5);
  std::filesystem::path directory_, path_;
};

TEST_F(DamagedMapTest, AStoreServesAsMemoryDoes) {
  const std::vector<Vector3> points = random_points(3000, 12.0);
  const DistanceField field(std::make_shared<StoreTileSource>(path_, builder_.geometry()),
                            {.num_threads = 2});
  std::vector<FieldSample> samples(points.size());
  field.at(points, samples);
  expect_identical(samples, answers(builder_, points, {}));
}

TEST_F(DamagedMapTest, UnreadableTilesAnswerUnknownAndAreCounted) {
  damage();
  const DistanceField field(std::make_shared<StoreTileSource>(path_, builder_.geometry()));
  EXPECT_EQ(field.at({0.5, 0.5, 0.5}).status, FieldStatus::kUnknown);
  EXPECT_EQ(field.at({-0.1, -0.5, -0.5}).status, FieldStatus::kFine);
  EXPECT_EQ(field.statistics().unreadable, 1u);
  EXPECT_NE(field.statistics().first_error.find("tile 0,0,0,0"), std::string::npos);
  // Its neighbours need it within their margins, and only there.
  EXPECT_EQ(field.at({-0.1, 0.5, 0.5}).status, FieldStatus::kUnknown);
  EXPECT_EQ(field.at({-0.25, 0.5, 0.5}).status, FieldStatus::kFine);
  EXPECT_EQ(field.at({-0.5, 0.5, 0.5}).status, FieldStatus::kFine);
}

TEST_F(DamagedMapTest, UnreadableTilesAnswerUnknownInTheAncestorsBlendingToo) {
  damage();
  const DistanceField field(std::make_shared<StoreTileSource>(path_, builder_.geometry()),
                            {.blend = BlendMode::kGdf1});
  EXPECT_EQ(field.at({0.5, 0.5, 0.5}).status, FieldStatus::kUnknown);
  EXPECT_EQ(field.at({-0.1, 0.5, 0.5}).status, FieldStatus::kUnknown);
  EXPECT_EQ(field.statistics().unreadable, 1u);
}

}  // namespace
}  // namespace gdfmap
