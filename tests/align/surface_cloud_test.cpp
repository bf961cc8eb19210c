#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include <gdfmap/align/surface_cloud.hpp>
#include <gdfmap/core/error.hpp>

#include "align_fixtures.hpp"

namespace gdfmap {
namespace {

TEST(SurfaceCloud, NormalsStandAcrossThePlanesOfACorner) {
  const SurfaceCloud cloud(test::corner_points(30'000, 5.0, 0.001, 1), 0.1, 1);
  int num_checked = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vector3& p = cloud.points()[i];
    if (p.x() < 0.5 || p.y() < 0.5 || p.z() > 0.1) continue;  // the floor, away from the walls
    EXPECT_GT(std::abs(cloud.normals()[i].z()), 0.999);
    EXPECT_NEAR(cloud.normals()[i].norm(), 1.0, 1e-12);
    ++num_checked;
  }
  EXPECT_GT(num_checked, 1000);
}

TEST(SurfaceCloud, IsTheSameForAnyNumberOfThreads) {
  const std::vector<Vector3> points = test::corner_points(20'000, 5.0, 0.02, 1);
  const SurfaceCloud one(points, 0.1, 1), four(points, 0.1, 4);
  EXPECT_EQ(one.points(), four.points());
  EXPECT_EQ(one.normals(), four.normals());
}

TEST(SurfaceCloud, LeavesOutWhatIsNotFiniteOrFarBeyondReason) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const std::vector<Vector3> points = {
      {0.1, 0.1, 0.1}, {nan, 0.0, 0.0}, {0.0, infinity, 0.0}, {0.0, 0.0, 1e12}, {3.1, 0.1, 0.1}};
  EXPECT_EQ(SurfaceCloud(points, 0.5, 1).size(), 2u);
  EXPECT_EQ(voxel_means(points, 0.0).size(), 3u);
}

TEST(VoxelMeans, AreTheMeansOfTheVoxels) {
  const std::vector<Vector3> points = {{0.1, 0.1, 0.1}, {-0.1, 0.1, 0.1}, {0.3, 0.3, 0.1}};
  std::vector<Vector3> means = voxel_means(points, 0.5);
  ASSERT_EQ(means.size(), 2u);
  std::sort(means.begin(), means.end(),
            [](const Vector3& a, const Vector3& b) { return a.x() < b.x(); });
  EXPECT_LT((means[0] - points[1]).norm(), 1e-15);
  EXPECT_LT((means[1] - Vector3(0.2, 0.2, 0.1)).norm(), 1e-15);
}

TEST(VoxelMeans, RefuseANegativeEdge) { EXPECT_THROW(voxel_means({}, -1.0), Error); }

}  // namespace
}  // namespace gdfmap
