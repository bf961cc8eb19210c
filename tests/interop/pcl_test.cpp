#include <limits>

#include <gtest/gtest.h>
#include <pcl/point_types.h>

#include <gdfmap/interop/pcl.hpp>
#include <gdfmap/pipeline/ingest.hpp>
#include <gdfmap/query/distance_field.hpp>
#include <gdfmap/train/train.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZI>;

Cloud cloud_of(std::span<const Vector3> points) {
  Cloud cloud;
  for (const Vector3& p : points) {
    pcl::PointXYZI point;
    point.getVector3fMap() = p.cast<float>();
    cloud.push_back(point);
  }
  return cloud;
}

TEST(PclInterop, AReaderYieldsEveryPointInOrder) {
  Cloud cloud = cloud_of({{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}});
  cloud[1].y = std::numeric_limits<float>::quiet_NaN();
  PclPointReader reader(cloud);
  EXPECT_EQ(reader.info().num_points, 3u);
  std::array<Vector3, 2> points;
  ASSERT_EQ(reader.read(points), 2u);
  EXPECT_EQ(points[0], Vector3(1, 2, 3));
  EXPECT_TRUE(std::isnan(points[1].y()));
  ASSERT_EQ(reader.read(points), 1u);
  EXPECT_EQ(points[0], Vector3(7, 8, 9));
  EXPECT_EQ(reader.read(points), 0u);
  EXPECT_EQ(positions(cloud)[2], Vector3(7, 8, 9));
}

TEST(PclInterop, ACloudIsTheSameSourceAsLongAsItsPointsAreTheSame) {
  Cloud cloud = cloud_of({{{1, 2, 3}, {4, 5, 6}}});
  const Digest identity = PclPointReader(cloud).identity();
  cloud[0].intensity = 5.0f;
  EXPECT_EQ(PclPointReader(cloud).identity(), identity);
  cloud[0].x = 1.5f;
  EXPECT_NE(PclPointReader(cloud).identity(), identity);
}

TEST(PclInterop, ACloudBecomesAFieldThatAnswersAtItsPoints) {
  const test::TemporaryDirectory directory;
  const Cloud cloud = cloud_of(test::scene_points("sphere", 3000, 2.0));
  Map map = Map::create(directory / "a.gdfmap");
  PclPointReader reader(cloud);
  const IngestReport report = ingest_points(reader, "cloud", map.lattice(), map.points(), {}, {});
  EXPECT_EQ(report.source.counts.num_read, cloud.size());
  train(map);
  const DistanceField field(map);
  const std::vector<Vector3> points = positions(cloud);
  std::vector<FieldSample> samples(points.size());
  field.at(points, samples);
  for (const FieldSample& sample : samples) EXPECT_LT(std::abs(sample.distance), 0.2);
}

}  // namespace
}  // namespace gdfmap
