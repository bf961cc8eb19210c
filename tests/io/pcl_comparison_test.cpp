#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include "io_test_support.hpp"

namespace gdfmap::io_test {
namespace {

const std::filesystem::path kData = GDFMAP_SHARED_DATA;

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

Cloud read_with_pcl(const std::filesystem::path& path) {
  pcl::console::setVerbosityLevel(pcl::console::L_ERROR);
  Cloud cloud;
  const int result = path.extension() == ".ply" ? pcl::io::loadPLYFile(path.string(), cloud)
                                                : pcl::io::loadPCDFile(path.string(), cloud);
  EXPECT_EQ(result, 0) << "PCL cannot read " << path;
  return cloud;
}

/// PCL holds float32: the comparison is of what our doubles round to.
void expect_as_pcl_reads(const std::filesystem::path& path) {
  SCOPED_TRACE(path);
  const Cloud expected = read_with_pcl(path);
  const Points actual = read_points(path);
  ASSERT_EQ(actual.size(), expected.size());
  for (std::size_t i = 0; i < actual.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = static_cast<float>(actual[i][axis]);
      ASSERT_TRUE(same(value, expected[i].data[axis]))
          << "point " << i << ", axis " << axis << ": " << value << " instead of "
          << expected[i].data[axis];
    }
  }
}

TEST(PclComparison, RealFilesGiveTheSamePoints) {
  if (!std::filesystem::is_directory(kData)) GTEST_SKIP() << "no real clouds at " << kData;
  std::vector<std::filesystem::path> paths = {kData / "hancock_room_crop.ply",
                                              kData / "small_gicp_pair/source.ply",
                                              kData / "small_gicp_pair/target.ply"};
  for (const char* folder : {"readers", "norlab_scans"}) {
    for (const auto& entry : std::filesystem::directory_iterator(kData / folder)) {
      if (entry.path().extension() == ".pcd") paths.push_back(entry.path());
    }
  }
  ASSERT_EQ(paths.size(), 3u + 4u + 14u);
  for (const auto& path : paths) expect_as_pcl_reads(path);
}

/// Clouds with runs, repetitions, noise and NaN, so that PCL's compressor uses every kind of
/// command.
template <typename Point, typename F>
pcl::PointCloud<Point> make_cloud(std::size_t count, const F& set_rest) {
  pcl::PointCloud<Point> cloud;
  std::uint32_t state = 1;
  for (std::size_t i = 0; i < count; ++i) {
    state = state * 1664525u + 1013904223u;
    Point p;
    p.x = i % 5000 < 3000 ? 1.25f : static_cast<float>(state >> 20) * 0.01f;
    p.y = static_cast<float>(i % 700) * 0.5f;
    p.z = i % 97 == 0 ? std::nanf("") : static_cast<float>(state >> 8) * 1e-4f;
    set_rest(p, state);
    cloud.push_back(p);
  }
  return cloud;
}

template <typename Point>
void expect_pcl_files_to_be_read(const pcl::PointCloud<Point>& cloud) {
  const TestDirectory directory;
  ASSERT_EQ(pcl::io::savePCDFileASCII((directory / "a.pcd").string(), cloud), 0);
  ASSERT_EQ(pcl::io::savePCDFileBinary((directory / "b.pcd").string(), cloud), 0);
  ASSERT_EQ(pcl::io::savePCDFileBinaryCompressed((directory / "c.pcd").string(), cloud), 0);
  ASSERT_EQ(pcl::io::savePLYFileBinary((directory / "b.ply").string(), cloud), 0);
  for (const char* name : {"a.pcd", "b.pcd", "c.pcd", "b.ply"}) {
    expect_as_pcl_reads(directory / name);
  }
}

TEST(PclComparison, FilesWrittenByPclAreRead) {
  expect_pcl_files_to_be_read(
      make_cloud<pcl::PointXYZ>(70'000, [](pcl::PointXYZ&, std::uint32_t) {}));
  expect_pcl_files_to_be_read(
      make_cloud<pcl::PointXYZI>(30'000, [](pcl::PointXYZI& p, std::uint32_t random) {
        p.intensity = static_cast<float>(random >> 24);
      }));
  expect_pcl_files_to_be_read(make_cloud<pcl::PointXYZRGBNormal>(
      30'000, [](pcl::PointXYZRGBNormal& p, std::uint32_t random) {
        p.rgba = random;
        p.normal_x = p.normal_y = p.normal_z = 0.0f;
        p.curvature = static_cast<float>(random & 3);
      }));
  expect_pcl_files_to_be_read(make_cloud<pcl::PointXYZ>(1, [](pcl::PointXYZ&, std::uint32_t) {}));
}

TEST(PclComparison, PclReadsWhatOurWritersWrite) {
  const TestDirectory directory;
  Points points;
  for (int i = 0; i < 5000; ++i) points.emplace_back(i, i * 0.5, -i * 0.25);
  for (const char* name : {"w.ply", "w.pcd"}) {
    const auto writer = create_point_cloud(directory / name, {.double_precision = false});
    writer->write(points);
    writer->finish();
    EXPECT_EQ(read_with_pcl(directory / name).size(), points.size());
    expect_as_pcl_reads(directory / name);
  }
}

}  // namespace
}  // namespace gdfmap::io_test
