#include "io_test_support.hpp"

namespace gdfmap::io_test {
namespace {

const std::filesystem::path kData = GDFMAP_SHARED_DATA;

struct Summary {
  std::size_t num_points = 0;
  std::size_t num_finite = 0;
  std::uint64_t num_withheld = 0;
  Box3 bounds;
};

Summary summarize(const std::filesystem::path& path) {
  const auto reader = open_point_cloud(path);
  Summary summary;
  for (const Vector3& p : read_rest(*reader)) {
    ++summary.num_points;
    if (!p.allFinite()) continue;
    ++summary.num_finite;
    summary.bounds.extend(p);
  }
  summary.num_withheld = reader->num_withheld();
  EXPECT_EQ(reader->info().num_points, summary.num_points + summary.num_withheld);
  static_cast<void>(reader->identity());
  EXPECT_EQ(reader->num_bytes(), std::filesystem::file_size(path));
  return summary;
}

class RealFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::is_directory(kData)) {
      GTEST_SKIP() << "no real clouds at " << kData;
    }
  }
};

TEST_F(RealFiles, AnIndoorCropHasItsCountAndExtent) {
  const Summary s = summarize(kData / "hancock_room_crop.ply");
  EXPECT_EQ(s.num_points, 779346u);
  EXPECT_EQ(s.num_finite, 779346u);
  EXPECT_LE((s.bounds.sizes() - Vector3(6.0, 6.0, 2.4855)).cwiseAbs().maxCoeff(), 0.001);
}

TEST_F(RealFiles, AnAerialCropKeepsItsLargeCoordinates) {
  const Summary s = summarize(kData / "autzen_crop_feet.las");
  EXPECT_EQ(s.num_points, 185535u);
  // The header's own bounds.
  EXPECT_LE((s.bounds.min() - Vector3(636900.02, 851000.03, 416.70)).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LE((s.bounds.max() - Vector3(637499.99, 851549.99, 586.12)).cwiseAbs().maxCoeff(), 1e-6);
}

TEST_F(RealFiles, LasOfLaterVersionsAgreesWithItsHeader) {
  const Summary v13 = summarize(kData / "readers/pdrf4-1.3.las");
  EXPECT_EQ(v13.num_points, 1024u);
  EXPECT_LE((v13.bounds.min() - Vector3(-70.0, -22.53, -10.0)).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LE((v13.bounds.max() - Vector3(103.91, 90.0, 12.08)).cwiseAbs().maxCoeff(), 1e-6);
  const Summary v14 = summarize(kData / "readers/pdrf7-v4-1.4.las");
  EXPECT_EQ(v14.num_points, 512u);
  EXPECT_EQ(v14.num_withheld, 512u);  // every second group of four has the flag
}

TEST_F(RealFiles, LazIsRefused) { expect_corrupt(kData / "readers/extrabytes.laz", "laszip"); }

TEST_F(RealFiles, ScansHaveAsManyPointsAsTheirSizeSays) {
  int num_scans = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kData / "norlab_scans")) {
    if (entry.path().extension() != ".pcd") continue;
    SCOPED_TRACE(entry.path());
    constexpr std::size_t kBytesPerPoint = 12, kHeaderBytes = 172;  // the same text but the count
    EXPECT_EQ(summarize(entry.path()).num_points,
              (entry.file_size() - kHeaderBytes) / kBytesPerPoint);
    ++num_scans;
  }
  EXPECT_EQ(num_scans, 14);
}

TEST_F(RealFiles, OtherFilesHaveTheirCounts) {
  EXPECT_EQ(summarize(kData / "small_gicp_pair/source.ply").num_points, 69792u);
  EXPECT_EQ(summarize(kData / "small_gicp_pair/target.ply").num_points, 69088u);
  EXPECT_EQ(summarize(kData / "readers/bun0.pcd").num_points, 397u);
  EXPECT_EQ(summarize(kData / "readers/colored_cloud.pcd").num_points, 1000u);
  EXPECT_EQ(summarize(kData / "readers/simple-ascii.pcd").num_points, 213u);
  const Summary office = summarize(kData / "readers/office1.pcd");
  EXPECT_EQ(office.num_points, 640u * 480u);
  EXPECT_EQ(office.num_finite, 640u * 480u - 52744u);
}

}  // namespace
}  // namespace gdfmap::io_test
