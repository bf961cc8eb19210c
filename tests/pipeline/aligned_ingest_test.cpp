#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/aligned_ingest.hpp>
#include <gdfmap/pipeline/ingest.hpp>
#include <gdfmap/train/train.hpp>

#include "support/lidar_room.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

namespace fs = std::filesystem;

/// Where the room stands: far from the world's origin.
const Vector3 kRoom(412345.0, 4512345.0, 212.0);

const RunContext kContext{.num_threads = 2, .memory_bytes = kMinAlignmentMemory};
const test::LidarOptions kLidar{.num_rings = 32, .num_columns = 512};

Eigen::Isometry3d pose(const Vector3& translation, double yaw_deg) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() =
      Eigen::AngleAxisd(yaw_deg * std::numbers::pi / 180.0, Vector3::UnitZ()).toRotationMatrix();
  T.translation() = translation;
  return T;
}

/// What a lidar sees from a pose in the room, in a frame that is off by `error` about the sensor.
std::vector<Vector3> scan(const Eigen::Isometry3d& T_room_sensor, std::uint32_t seed,
                          const Eigen::Isometry3d& error = Eigen::Isometry3d::Identity()) {
  std::vector<Vector3> points = test::lidar_scan_of_room(T_room_sensor, seed, kLidar);
  for (Vector3& p : points) p = kRoom + T_room_sensor * (error * p);
  return points;
}

double angle_deg(const Eigen::Isometry3d& T) {
  return Eigen::AngleAxisd(T.linear()).angle() * 180.0 / std::numbers::pi;
}

/// A map of the room from two places, and scans that come later.
class AlignedIngest : public testing::Test {
 protected:
  AlignedIngest() : map_(open_or_create_map(directory_ / "room.gdfmap", {})) {
    for (const double x : {-3.0, 3.0}) {
      const fs::path file = directory_ / ("map" + std::to_string(x) + ".ply");
      test::write_cloud(file,
                        scan(pose({x, 1.0, 1.5}, 10.0 * x), static_cast<std::uint32_t>(x + 9)));
      static_cast<void>(ingest(file, map_));
    }
    digests_ = digests();
  }

  [[nodiscard]] std::map<TileKey, Digest> digests() {
    std::map<TileKey, Digest> result;
    map_.points().for_each_tile([&](const TilePoints& tile) { result[tile.key] = tile.digest; });
    return result;
  }
  [[nodiscard]] fs::path write(const std::string& name, std::span<const Vector3> points) {
    test::write_cloud(directory_ / name, points);
    return directory_ / name;
  }
  AlignedIngestReport ingest_one(const fs::path& cloud, const IngestOptions& options = {},
                                 const std::string& method = "auto") {
    AlignmentOptions alignment;
    alignment.method = method;
    return ingest_aligned(std::span(&cloud, 1), std::span(&options, 1), map_, alignment, kContext);
  }
  /// How far the pose that was found takes the scan's centre and axes from where they belong.
  static void expect_true_pose(const AlignmentReport& report,
                               const Eigen::Isometry3d& T_room_sensor,
                               const Eigen::Isometry3d& error) {
    const Eigen::Isometry3d to_room = Eigen::Translation3d(kRoom) * T_room_sensor;
    const Eigen::Isometry3d left =
        to_room.inverse() * report.registration.T_target_source * to_room * error;
    EXPECT_LT(left.translation().norm(), 0.02);
    EXPECT_LT(angle_deg(left), 0.2);
  }

  test::TemporaryDirectory directory_;
  Map map_;
  std::map<TileKey, Digest> digests_;
};

TEST_F(AlignedIngest, AShiftedScanIsMovedOntoTheMapAndPublished) {
  const Eigen::Isometry3d T = pose({0.5, -0.5, 1.5}, 20.0), error = pose({0.2, 0.2, 0.1}, 2.0);
  const fs::path cloud = write("shifted.ply", scan(T, 30, error));
  const AlignedIngestReport report = ingest_one(cloud);
  ASSERT_TRUE(report.accepted()) << report.alignments[0].reason;
  expect_true_pose(report.alignments[0], T, error);
  EXPECT_GT(report.alignments[0].registration.inlier_ratio, 0.8);

  const std::vector<SourceRecord> sources = map_.points().sources();
  ASSERT_EQ(sources.size(), 3U);
  EXPECT_TRUE(sources[2].alignment.starts_with("method=auto T_map_nominal="));
  // The points that are stored are those that the pose moves: as if ingested with it.
  Map direct = open_or_create_map(directory_ / "direct.gdfmap", {});
  IngestOptions moved;
  moved.transform.T_map_source = report.alignments[0].registration.T_target_source;
  static_cast<void>(ingest(cloud, direct, moved));
  map_.points().remove(1);
  map_.points().remove(2);
  std::map<TileKey, Digest> expected;
  direct.points().for_each_tile([&](const TilePoints& t) { expected[t.key] = t.digest; });
  EXPECT_EQ(digests(), expected);
}

TEST_F(AlignedIngest, TheFieldOfATrainedMapAlignsAScan) {
  train(map_);
  const Eigen::Isometry3d T = pose({0.5, -0.5, 1.5}, 20.0), error = pose({0.1, 0.1, 0.05}, 1.0);
  const AlignedIngestReport report =
      ingest_one(write("shifted.ply", scan(T, 30, error)), {}, "field");
  ASSERT_TRUE(report.accepted()) << report.alignments[0].reason;
  expect_true_pose(report.alignments[0], T, error);
  EXPECT_TRUE(map_.points().sources()[2].alignment.starts_with("method=field T_map_nominal="));
}

TEST_F(AlignedIngest, TheSameScanAgainIsKnownBeforeItIsRegistered) {
  const fs::path cloud =
      write("shifted.ply", scan(pose({0.5, -0.5, 1.5}, 20.0), 30, pose({0.2, 0, 0}, 1.0)));
  ASSERT_TRUE(ingest_one(cloud).accepted());
  const auto after = digests();
  const AlignedIngestReport again = ingest_one(cloud);
  EXPECT_TRUE(again.alignments.empty());
  ASSERT_EQ(again.sources.size(), 1U);
  EXPECT_TRUE(again.sources[0].already_present);
  EXPECT_EQ(digests(), after);
}

TEST_F(AlignedIngest, ASensorMovesWithItsScan) {
  const Eigen::Isometry3d T = pose({0.5, -0.5, 1.5}, 20.0);
  IngestOptions options;
  options.transform.T_map_source = Eigen::Translation3d(kRoom + Vector3(0.2, -0.1, 0.0)) * T;
  options.sensor_origin_source = Vector3::Zero();
  const AlignedIngestReport report =
      ingest_one(write("sensor.ply", test::lidar_scan_of_room(T, 31, kLidar)), options);
  ASSERT_TRUE(report.accepted()) << report.alignments[0].reason;
  EXPECT_LT((*report.sources[0].source.sensor_origin - kRoom - T.translation()).norm(), 0.02);
}

TEST_F(AlignedIngest, AScanOfAnotherPlaceLeavesTheMapAsItIs) {
  std::vector<Vector3> elsewhere = scan(pose({0, 0, 1.5}, 0.0), 32);
  for (Vector3& p : elsewhere) p += Vector3(200.0, 0.0, 0.0);
  const AlignedIngestReport report = ingest_one(write("elsewhere.ply", elsewhere));
  EXPECT_FALSE(report.accepted());
  EXPECT_FALSE(report.alignments[0].accepted);
  EXPECT_NE(report.alignments[0].reason, "");
  EXPECT_EQ(digests(), digests_);
  EXPECT_EQ(map_.points().sources().size(), 2U);
}

TEST_F(AlignedIngest, OneScanThatDoesNotFitKeepsTheOthersOut) {
  std::vector<Vector3> noise;
  for (const Vector3& p : scan(pose({0, 0, 1.5}, 0.0), 33)) {
    // Inside out: surfaces where the room has none.
    noise.push_back(kRoom + 0.5 * (p - kRoom));
  }
  const std::vector<fs::path> clouds = {write("fits.ply", scan(pose({0, 0, 1.5}, 5.0), 34)),
                                        write("noise.ply", noise)};
  const std::vector<IngestOptions> options(2);
  const AlignedIngestReport report = ingest_aligned(clouds, options, map_, {}, kContext);
  ASSERT_EQ(report.alignments.size(), 2U);
  EXPECT_TRUE(report.alignments[0].accepted) << report.alignments[0].reason;
  EXPECT_FALSE(report.alignments[1].accepted);
  EXPECT_FALSE(report.accepted());
  EXPECT_EQ(digests(), digests_);
}

TEST_F(AlignedIngest, ABentScanIsFoundByItsPatches) {
  std::vector<Vector3> bent = scan(pose({0.5, -0.5, 1.5}, 20.0), 35);
  // The half beyond x = 0 drifts by up to a quarter of a metre.
  for (Vector3& p : bent) p.y() += 0.25 * std::clamp((p.x() - kRoom.x()) / 10.0, 0.0, 1.0);
  const AlignedIngestReport report = ingest_one(write("bent.ply", bent));
  EXPECT_FALSE(report.accepted());
  const AlignmentReport& a = report.alignments[0];
  ASSERT_FALSE(a.patch_shifts.empty()) << a.reason;
  EXPECT_NE(a.reason.find("patches"), std::string::npos) << a.reason;
  EXPECT_EQ(digests(), digests_);
}

TEST_F(AlignedIngest, AScanOfOnePlaneOrOfAFewPointsIsNoEvidence) {
  std::vector<Vector3> floor;
  for (const Vector3& p : scan(pose({0, 0, 1.5}, 0.0), 36)) {
    if (std::abs(p.z() - kRoom.z()) < 0.1) floor.push_back(p);
  }
  ASSERT_GT(floor.size(), 1000U);
  const AlignedIngestReport of_floor = ingest_one(write("floor.ply", floor));
  EXPECT_FALSE(of_floor.accepted());
  const AlignedIngestReport of_few = ingest_one(write("few.ply", std::span(floor).first(30)));
  EXPECT_EQ(of_few.alignments[0].registration.status, RegistrationStatus::kTooFew);
  EXPECT_EQ(digests(), digests_);
}

TEST_F(AlignedIngest, RefusesWhatCannotBeAligned) {
  const auto code_of = [&](const fs::path& cloud, const IngestOptions& options,
                           const std::string& method) {
    try {
      static_cast<void>(ingest_one(cloud, options, method));
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::kInternal;
  };
  const fs::path cloud = write("a.ply", scan(pose({0, 0, 1.5}, 0.0), 37));
  IngestOptions replacing;
  replacing.replaced_source = 1;
  EXPECT_EQ(code_of("-", {}, "auto"), ErrorCode::kUsage);
  EXPECT_EQ(code_of(cloud, replacing, "auto"), ErrorCode::kUsage);
  EXPECT_EQ(code_of(cloud, {}, "magic"), ErrorCode::kUsage);
  const RunContext tight{.memory_bytes = kMinAlignmentMemory - 1};
  const IngestOptions options;
  EXPECT_THROW(static_cast<void>(
                   ingest_aligned(std::span(&cloud, 1), std::span(&options, 1), map_, {}, tight)),
               Error);
  EXPECT_EQ(digests(), digests_);
}

/// Scans of a robot that hardly moves, with their poses; the last one comes later, put wrong.
TEST(AlignedIngestOfRealScans, BringsAScanBackToItsPose) {
  const fs::path data = fs::path(GDFMAP_SHARED_DATA) / "norlab_scans";
  if (!fs::exists(data)) GTEST_SKIP() << data << " is not there";
  constexpr std::size_t kNumScans = 14;
  std::vector<fs::path> clouds;
  for (std::size_t i = 0; i < kNumScans; ++i) {
    clouds.push_back(data / ((i < 10 ? "00000" : "0000") + std::to_string(i) + ".pcd"));
  }
  std::vector<IngestOptions> options = posed_options({}, data / "poses.txt", kNumScans);
  const test::TemporaryDirectory directory;
  Map map = open_or_create_map(directory / "m.gdfmap", {});
  for (std::size_t i = 0; i + 1 < kNumScans; ++i) {
    static_cast<void>(ingest(clouds[i], map, options[i]));
  }
  const Eigen::Isometry3d given = options.back().transform.T_map_source;
  options.back().transform.T_map_source = given * pose({0.2, -0.2, 0.1}, 2.0);
  const AlignedIngestReport report =
      ingest_aligned(std::span(clouds).last(1), std::span(options).last(1), map, {}, kContext);
  ASSERT_TRUE(report.accepted()) << report.alignments[0].reason;
  const Eigen::Isometry3d found =
      report.alignments[0].registration.T_target_source * options.back().transform.T_map_source;
  EXPECT_LT((given.translation() - found.translation()).norm(), 0.02);
  EXPECT_LT(angle_deg(given.inverse() * found), 0.2);
}

/// Sparse scans of a car, whose neighbouring voxels lie centimetres off one another's surface.
TEST(AlignedIngestOfRealScans, AcceptsASparseScanThatIsAsNoisyAsTheMap) {
  const fs::path data = fs::path(GDFMAP_SHARED_DATA) / "small_gicp_pair";
  if (!fs::exists(data)) GTEST_SKIP() << data << " is not there";
  const test::TemporaryDirectory directory;
  Map map = open_or_create_map(directory / "m.gdfmap", {});
  IngestOptions options;
  options.drop_zero = true;
  static_cast<void>(ingest(data / "target.ply", map, options));
  const fs::path source = data / "source.ply";
  const AlignedIngestReport report =
      ingest_aligned(std::span(&source, 1), std::span(&options, 1), map, {}, kContext);
  ASSERT_TRUE(report.accepted()) << report.alignments[0].reason;
  const Eigen::Isometry3d given = read_transform(data / "T_target_source.txt");
  const Eigen::Isometry3d& found = report.alignments[0].registration.T_target_source;
  EXPECT_LT((given.translation() - found.translation()).norm(), 0.02);
  EXPECT_LT(angle_deg(given.inverse() * found), 0.4);
}

}  // namespace
}  // namespace gdfmap
