#include <algorithm>

#include <gtest/gtest.h>

#include <gdfmap/align/map_window.hpp>

#include "align_fixtures.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

/// Points in the world's frame, so that windows with different origins can be compared.
std::vector<Vector3> surface_points_world(const MapWindow& window, double voxel) {
  std::vector<Vector3> points = window.surface(voxel, 1).points();
  for (Vector3& p : points) p += window.origin_world();
  std::sort(points.begin(), points.end(), [](const Vector3& a, const Vector3& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  return points;
}

void expect_near(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_LT((a[i] - b[i]).norm(), 1e-9) << i;
}

TEST(MapWindow, DoesNotDependOnTheOrderOfThePoints) {
  std::vector<Vector3> points = test::corner_points(20'000, 12.0, 0.02, 1);
  const MapWindow forward(points);
  std::reverse(points.begin(), points.end());
  const MapWindow backward(points);
  EXPECT_EQ(forward.origin_world(), backward.origin_world());
  EXPECT_EQ(forward.surface(0.25, 1).points(), backward.surface(0.25, 1).points());
  EXPECT_EQ(forward.surface(0.25, 1).normals(), backward.surface(0.25, 1).normals());
  ASSERT_EQ(forward.cells(1.0).cells().size(), backward.cells(1.0).cells().size());
  for (std::size_t i = 0; i < forward.cells(1.0).cells().size(); ++i) {
    EXPECT_EQ(forward.cells(1.0).cells()[i].mean, backward.cells(1.0).cells()[i].mean);
  }
}

TEST(MapWindow, OfAMapIsThatOfItsPointsAroundTheScan) {
  const test::TemporaryDirectory directory;
  const std::vector<Vector3> near = test::corner_points(20'000, 12.0, 0.02, 1);
  std::vector<Vector3> all = near;
  for (const Vector3& p : near) all.push_back(p + Vector3(200.0, 0.0, 0.0));
  Map map = test::map_of(directory / "a.gdfmap", all);
  const MapWindow window(map, near, MapWindow::MapOptions{});
  expect_near(surface_points_world(window, 0.25), surface_points_world(MapWindow(near), 0.25));
  EXPECT_EQ(window.num_tiles_left_out(), 0u);
  EXPECT_EQ(window.field(), nullptr);
}

TEST(MapWindow, LeavesOutTheFarthestTilesThatItsBytesDoNotHold) {
  const test::TemporaryDirectory directory;
  const std::vector<Vector3> points = test::corner_points(40'000, 40.0, 0.02, 1);
  Map map = test::map_of(directory / "a.gdfmap", points);
  const std::vector<Vector3> scan = test::corner_points(500, 40.0, 0.02, 2);
  MapWindow::MapOptions options;
  const MapWindow whole(map, scan, options);
  options.max_bytes = 2'000'000;
  const MapWindow part(map, scan, options);
  EXPECT_GT(part.num_tiles(), 0u);
  EXPECT_GT(part.num_tiles_left_out(), 0u);
  EXPECT_EQ(part.num_tiles() + part.num_tiles_left_out(), whole.num_tiles());
  EXPECT_LT(part.surface(0.25, 1).size() * 320, 2'000'000u);
  Vector3 center = Vector3::Zero();
  for (const Vector3& p : scan) center += p / 500.0;
  const auto reach = [&](const MapWindow& window) {
    double farthest = 0.0;
    for (const Vector3& p : surface_points_world(window, 0.25)) {
      farthest = std::max(farthest, (p - center).norm());
    }
    return farthest;
  };
  EXPECT_LT(reach(part), reach(whole));
}

TEST(MapWindow, IsEmptyWhereTheMapIs) {
  const test::TemporaryDirectory directory;
  Map map = test::map_of(directory / "a.gdfmap", test::corner_points(1000, 5.0, 0.02, 1));
  const std::vector<Vector3> scan = {Vector3(1000.0, 0.0, 0.0)};
  const MapWindow window(map, scan, MapWindow::MapOptions{});
  EXPECT_EQ(window.num_points(), 0u);
  EXPECT_EQ(window.surface(0.25, 1).size(), 0u);
  EXPECT_TRUE(window.cells(1.0).cells().empty());
}

TEST(MapWindow, KeepsItsDigitsFarFromTheOriginOfTheWorld) {
  const Vector3 utm(512'345.0, 4'543'210.0, 300.0);
  const std::vector<Vector3> points = test::corner_points(5000, 8.0, 0.02, 1);
  std::vector<Vector3> far = points;
  for (Vector3& p : far) p += utm;
  const MapWindow here(points), there(far);
  std::vector<Vector3> expected = surface_points_world(here, 0.25);
  std::vector<Vector3> actual = surface_points_world(there, 0.25);
  for (Vector3& p : actual) p -= utm;
  ASSERT_EQ(actual.size(), expected.size());
  for (std::size_t i = 0; i < actual.size(); ++i) ASSERT_LT((actual[i] - expected[i]).norm(), 1e-6);
}

}  // namespace
}  // namespace gdfmap
