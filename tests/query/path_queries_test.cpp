#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/query/path_queries.hpp>

#include "field_builder.hpp"

namespace gdfmap {
namespace {

using test::constant_gaussians;
using test::FieldBuilder;

/// One cube at x = 20 that is nothing but surface; around it the field is the distance to its box.
FieldBuilder lone_cube() {
  return FieldBuilder({})
      .add({0, 20, 0, 0}, constant_gaussians(0.0f), CubeStatus::kFitted, 0.0f)
      .occupy({0, 20, 0, 0});
}

TEST(CastRay, EndsWhereTheDistanceFallsToTheRadius) {
  const DistanceField field(lone_cube().source());
  const RayHit hit = cast_ray(field, {{0.0, 0.5, 0.5}, {3.0, 0.0, 0.0}}, {.radius = 2.0});
  EXPECT_EQ(hit.end, RayEnd::kHit);
  EXPECT_NEAR(hit.range, 18.0, 0.01);
  EXPECT_NEAR(hit.free_range, 18.0, 0.01);
  EXPECT_TRUE(hit.place.isApprox(Vector3(hit.range, 0.5, 0.5)));
  EXPECT_EQ(hit.sample.status, FieldStatus::kFar);
  EXPECT_NEAR(hit.sample.distance, 2.0, 0.01);
}

TEST(CastRay, EndsAtItsRangeWhenNothingIsMet) {
  const DistanceField field(lone_cube().source());
  for (const Vector3& direction : {Vector3(-1, 0, 0), Vector3(0, 0, 1), Vector3(1, 0.5, 0)}) {
    const RayHit hit = cast_ray(field, {{0.0, 0.5, 0.5}, direction}, {.max_range = 30.0});
    EXPECT_EQ(hit.end, RayEnd::kMaxRange);
    EXPECT_EQ(hit.range, 30.0);
    EXPECT_EQ(hit.free_range, 30.0);
  }
}

TEST(CastRay, PassesBesideWhatIsFartherThanItsRadius) {
  const DistanceField field(lone_cube().source());
  const Ray ray{{0.0, 4.0, 0.5}, {1.0, 0.0, 0.0}};  // 3 m beside the cube
  EXPECT_EQ(cast_ray(field, ray, {.radius = 2.9}).end, RayEnd::kMaxRange);
  const RayHit hit = cast_ray(field, ray, {.radius = 3.1});
  EXPECT_EQ(hit.end, RayEnd::kHit);
  EXPECT_NEAR(hit.range, 20.0 - std::sqrt(3.1 * 3.1 - 9.0), 0.05);
}

TEST(CastRay, SaysWhereItsKnowledgeEnds) {
  // The tile from x = 40 on holds points and waits for its cubes.
  const FieldBuilder builder = lone_cube().occupy({0, 40, 0, 0});
  const DistanceField field(builder.source());
  const RayHit hit = cast_ray(field, {{30.0, 6.5, 6.5}, {1.0, 0.0, 0.0}}, {.tolerance = 0.001});
  EXPECT_EQ(hit.end, RayEnd::kUnknown);
  EXPECT_GE(hit.range, 40.0 - 30.0);
  EXPECT_LE(hit.free_range, hit.range);
  EXPECT_EQ(hit.sample.status, FieldStatus::kUnknown);
  EXPECT_EQ(cast_ray(field, {{45.0, 6.5, 6.5}, {1.0, 0.0, 0.0}}).range, 0.0);
}

TEST(CastRay, IsFreeOnlyAsFarAsTheErrorBoundAllows) {
  const FieldBuilder builder =
      FieldBuilder({}).add({0, 0, 0, 0}, constant_gaussians(0.5f), CubeStatus::kFitted, 0.06f);
  const DistanceField field(builder.source());  // conservative: 0.5 − 2 · 0.12 = 0.26
  const Ray ray{{0.3, 0.5, 0.5}, {1.0, 0.0, 0.0}};
  const RayHit narrow = cast_ray(field, ray, {.max_range = 0.3, .radius = 0.2});
  EXPECT_EQ(narrow.end, RayEnd::kMaxRange);
  EXPECT_NEAR(narrow.free_range, 0.3, 1e-12);
  const RayHit wide = cast_ray(field, ray, {.max_range = 0.3, .radius = 0.3});
  EXPECT_EQ(wide.end, RayEnd::kMaxRange);
  EXPECT_EQ(wide.free_range, 0.0);
}

TEST(CastRay, KnowsNoFreeRangeWithoutErrorBounds) {
  const float unknown = std::numeric_limits<float>::quiet_NaN();
  const FieldBuilder builder =
      FieldBuilder({}).add({0, 0, 0, 0}, constant_gaussians(0.5f), CubeStatus::kFitted, unknown);
  const DistanceField field(builder.source());
  const RayHit hit = cast_ray(field, {{0.3, 0.5, 0.5}, {1, 0, 0}}, {.max_range = 0.3});
  EXPECT_EQ(hit.end, RayEnd::kMaxRange);
  EXPECT_TRUE(std::isnan(hit.free_range));
  const std::vector<Vector3> path = {{0.3, 0.5, 0.5}, {0.6, 0.5, 0.5}};
  const PathClearance clearance = clearance_along(field, path);
  EXPECT_NEAR(clearance.distance, 0.5, 1e-6);
  EXPECT_TRUE(std::isnan(clearance.lower_bound));
  EXPECT_FALSE(clearance.is_free);
}

TEST(ClearanceAlong, FindsTheNarrowestPlace) {
  const DistanceField field(lone_cube().source());
  // Comes within 3 m of the cube on its second segment.
  const std::vector<Vector3> path = {{0.0, 4.0, 0.5}, {10.0, 4.0, 0.5}, {40.0, 4.0, 0.5}};
  const PathClearance clearance = clearance_along(field, path, {.radius = 1.0});
  EXPECT_EQ(clearance.length, 40.0);
  EXPECT_NEAR(clearance.distance, 3.0, 1e-3);
  EXPECT_GE(clearance.place_at, 20.0 - 0.1);
  EXPECT_LE(clearance.place_at, 21.0 + 0.1);
  EXPECT_TRUE(clearance.place.isApprox(Vector3(clearance.place_at, 4.0, 0.5)));
  EXPECT_LE(clearance.lower_bound, 3.0);
  EXPECT_GE(clearance.lower_bound, 3.0 - 0.0051);
  EXPECT_TRUE(clearance.is_free);
  EXPECT_EQ(clearance.unknown_length, 0.0);
}

TEST(ClearanceAlong, SaysHowFarARobotMayGo) {
  const DistanceField field(lone_cube().source());
  const std::vector<Vector3> path = {{0.0, 0.5, 0.5}, {30.0, 0.5, 0.5}};
  const PathClearance clearance = clearance_along(field, path, {.radius = 2.0});
  EXPECT_NEAR(clearance.free_length, 18.0, 0.01);
  EXPECT_FALSE(clearance.is_free);
  EXPECT_NEAR(clearance.distance, 0.0, 1e-6);
}

TEST(ClearanceAlong, MeasuresWhatItKnowsNothingOf) {
  const FieldBuilder builder = lone_cube().occupy({0, 40, 0, 0});
  const DistanceField field(builder.source());
  const std::vector<Vector3> path = {{39.0, 6.5, 6.5}, {50.0, 6.5, 6.5}};  // unknown from 40 to 48
  const PathClearance clearance = clearance_along(field, path);
  EXPECT_GE(clearance.unknown_length, 7.0);
  EXPECT_LE(clearance.unknown_length, 8.5);
  EXPECT_FALSE(clearance.is_free);
  EXPECT_LE(clearance.free_length, 9.0);
  EXPECT_GT(clearance.distance, 5.0);  // of what is known
  const std::vector<Vector3> inside = {{42.0, 6.5, 6.5}, {43.0, 6.5, 6.5}};
  const PathClearance nothing = clearance_along(field, inside);
  EXPECT_EQ(nothing.status, FieldStatus::kUnknown);
  EXPECT_TRUE(std::isnan(nothing.distance));
  EXPECT_TRUE(std::isnan(nothing.lower_bound));
  EXPECT_NEAR(nothing.unknown_length, 1.0, 1e-12);
}

TEST(ClearanceAlong, TakesASinglePointAndRepeatedOnes) {
  const DistanceField field(lone_cube().source());
  const Vector3 p(10.0, 0.5, 0.5);
  for (const std::size_t count : {1, 3}) {
    const std::vector<Vector3> path(count, p);
    const PathClearance clearance = clearance_along(field, path, {.radius = 9.0});
    EXPECT_EQ(clearance.length, 0.0);
    EXPECT_NEAR(clearance.distance, 10.0, 1e-9);
    EXPECT_TRUE(clearance.is_free);
    EXPECT_FALSE(clearance_along(field, path, {.radius = 11.0}).is_free);
  }
}

TEST(PathQueries, ManyTogetherAnswerAsEachAlone) {
  const DistanceField field(test::random_block(2, 0.3, 61).source());
  std::mt19937 random(62);
  std::uniform_real_distribution<double> uniform(-4.0, 4.0);
  const auto any_place = [&] { return Vector3(uniform(random), uniform(random), uniform(random)); };
  std::vector<Ray> rays;
  std::vector<std::vector<Vector3>> paths;
  for (int i = 0; i < 50; ++i) {
    rays.push_back({any_place(), any_place()});
    paths.push_back({any_place(), any_place(), any_place()});
  }
  const auto hits = cast_rays(field, rays);
  const auto clearances = clearances_along(field, paths);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const RayHit hit = cast_ray(field, rays[i]);
    EXPECT_EQ(hit.end, hits[i].end);
    EXPECT_EQ(hit.range, hits[i].range);
    EXPECT_EQ(hit.free_range, hits[i].free_range);
    const PathClearance clearance = clearance_along(field, paths[i]);
    EXPECT_EQ(clearance.distance, clearances[i].distance);
    EXPECT_EQ(clearance.place, clearances[i].place);
    EXPECT_EQ(clearance.lower_bound, clearances[i].lower_bound);
  }
}

TEST(PathQueries, RefuseWhatIsNoRayOrPath) {
  const DistanceField field(lone_cube().source());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Ray good{{0, 0, 0}, {1, 0, 0}};
  const auto refuses = [](const auto& query) {
    try {
      query();
      return false;
    } catch (const Error& error) {
      return error.code() == ErrorCode::kUsage;
    }
  };
  EXPECT_TRUE(refuses([&] { cast_ray(field, {{0, 0, 0}, {0, 0, 0}}); }));
  EXPECT_TRUE(refuses([&] { cast_ray(field, {{nan, 0, 0}, {1, 0, 0}}); }));
  EXPECT_TRUE(refuses([&] { cast_ray(field, {{0, 0, 0}, {nan, 0, 0}}); }));
  EXPECT_TRUE(refuses([&] { cast_ray(field, good, {.max_range = 0.0}); }));
  EXPECT_TRUE(refuses([&] { cast_ray(field, good, {.radius = -1.0}); }));
  EXPECT_TRUE(refuses([&] { cast_ray(field, good, {.tolerance = nan}); }));
  const std::vector<Vector3> none, bad = {{0, 0, nan}}, path = {{0, 0, 0}, {1, 0, 0}};
  EXPECT_TRUE(refuses([&] { clearance_along(field, none); }));
  EXPECT_TRUE(refuses([&] { clearance_along(field, bad); }));
  EXPECT_TRUE(refuses([&] { clearance_along(field, path, {.radius = nan}); }));
  EXPECT_TRUE(refuses([&] { clearance_along(field, path, {.tolerance = 0.0}); }));
}

}  // namespace
}  // namespace gdfmap
