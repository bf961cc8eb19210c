// Scans that are registered with the map before they are ingested.

#include <filesystem>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "e2e/expect.hpp"
#include "e2e/scene.hpp"
#include "support/lidar_room.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap::test {
namespace {

using Json = nlohmann::json;

constexpr int kUsage = 2;
constexpr int kCondition = 6;

Eigen::Isometry3d pose(double x, double y, double yaw_deg) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() =
      Eigen::AngleAxisd(yaw_deg * std::numbers::pi / 180.0, Vector3::UnitZ()).toRotationMatrix();
  T.translation() = Vector3(x, y, 1.5);
  return T;
}

/// A room that was scanned once, and scans that come later: one 0.3 m and 2 degrees off, one of
/// another building.
class Align : public ::testing::Test {
 protected:
  Align() {
    const LidarOptions lidar{.num_rings = 32, .num_columns = 512};
    const auto write = [&](const std::string& name, const Eigen::Isometry3d& T_map_sensor,
                           const Eigen::Isometry3d& T_room_sensor, std::uint32_t seed) {
      std::vector<Vector3> points = lidar_scan_of_room(T_room_sensor, seed, lidar);
      for (Vector3& p : points) p = T_map_sensor * p;
      write_cloud(path(name), points);
    };
    write("first.ply", pose(0, 0, 0), pose(0, 0, 0), 1);
    write("shifted.ply", pose(0.7, -0.6, 12), pose(0.5, -0.4, 10), 2);
    write("elsewhere.ply", pose(300, 0, 0), pose(1, 0, 0), 3);
    EXPECT_TRUE(exits_with(0, gdfmap({"ingest", map(), path("first.ply")})));
    before_ = database();
  }
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }
  /// All of points.db but SQLite's header, where it counts who had it open for writing.
  [[nodiscard]] std::string database() const {
    constexpr std::size_t kHeaderBytes = 100;
    return read_file(directory_ / "m.gdfmap" / "points.db").substr(kHeaderBytes);
  }
  [[nodiscard]] std::string map() const { return path("m.gdfmap"); }
  [[nodiscard]] std::vector<std::string> align(const std::vector<std::string>& arguments) const {
    std::vector<std::string> command = {"ingest", map(), "--align", "--memory", "512M"};
    for (const std::string& argument : arguments) {
      command.push_back(argument.starts_with("--") ? argument : path(argument));
    }
    return command;
  }
  [[nodiscard]] Json json(const std::vector<std::string>& command) const {
    return Json::parse(gdfmap(command).out);
  }
  [[nodiscard]] Json sources() const { return json({"sources", map(), "--json"}).at("sources"); }
  /// What the map's points are: the same before and after something that changed nothing.
  [[nodiscard]] Json points() const {
    Json points = json({"info", map(), "--json"}).at("points");
    points.erase("estimate");
    return points;
  }

  TemporaryDirectory directory_;
  std::string before_;
};

TEST_F(Align, AScanThatIsOffIsMovedOntoTheMap) {
  const Result result = gdfmap(align({"shifted.ply", "--json"}));
  ASSERT_TRUE(exits_with(0, result));
  const Json report = Json::parse(result.out);
  EXPECT_TRUE(report.at("alignments").at(0).at("accepted"));
  const Json& registration = report["alignments"][0].at("registration");
  EXPECT_GT(registration.at("inlier_ratio"), 0.8);
  EXPECT_EQ(report.at("sources").size(), 1U);
  // What was found is what was put wrong.
  const Eigen::Isometry3d expected = pose(0.5, -0.4, 10) * pose(0.7, -0.6, 12).inverse();
  const Vector3 sensor = pose(0.7, -0.6, 12).translation();
  Eigen::Matrix4d T;
  const Json& rows = registration.at("T_target_source");
  for (int i = 0; i < 16; ++i) {
    T(i / 4, i % 4) = rows.at(static_cast<std::size_t>(i / 4)).at(static_cast<std::size_t>(i % 4));
  }
  EXPECT_LT(((T * sensor.homogeneous()).head<3>() - expected * sensor).norm(), 0.02);
  EXPECT_LT((T.topLeftCorner<3, 3>() - expected.linear()).norm(), 0.005);
  ASSERT_EQ(sources().size(), 2U);
  EXPECT_TRUE(sources()[1].at("alignment").get<std::string>().starts_with("method=auto "));
  EXPECT_TRUE(sources()[0].at("alignment").is_null());
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", map()})));
}

TEST_F(Align, AScanThatDoesNotFitPublishesNothing) {
  const Json before = points();
  const Result result = gdfmap(align({"shifted.ply", "elsewhere.ply"}));
  EXPECT_TRUE(exits_with(kCondition, result));
  EXPECT_NE(result.err.find("elsewhere.ply: not aligned, nothing was ingested: "),
            std::string::npos)
      << result.err;
  EXPECT_NE(result.out.find("rejected"), std::string::npos) << result.out;
  EXPECT_EQ(points(), before);
  EXPECT_TRUE(database() == before_);
  const Json report = json(align({"elsewhere.ply", "--json"}));
  EXPECT_FALSE(report.at("alignments").at(0).at("accepted"));
  EXPECT_TRUE(report.at("sources").empty());
}

TEST_F(Align, KilledInBetweenItLeavesNothingPublished) {
  const Json before = points();
  for (const char* const failpoint :
       {"ingest.before_append:1", "ingest.after_append:1", "ingest.before_publish:1"}) {
    const Result killed = gdfmap_until(failpoint, align({"shifted.ply"}));
    ASSERT_NE(killed.signal, 0) << failpoint << killed.err;
    EXPECT_EQ(points(), before) << failpoint;
  }
  EXPECT_TRUE(exits_with(0, gdfmap(align({"shifted.ply"}))));
  EXPECT_EQ(sources().size(), 2U);
  const Json after = points();
  const Result again = gdfmap(align({"shifted.ply"}));
  EXPECT_TRUE(exits_with(0, again));
  EXPECT_NE(again.out.find("it is in the map already"), std::string::npos);
  EXPECT_EQ(points(), after);
}

TEST_F(Align, AMapWithoutPointsIsNothingToAlignWith) {
  const std::string fresh = path("fresh.gdfmap");
  EXPECT_TRUE(exits_with(
      kCondition, gdfmap({"ingest", fresh, "--memory", "512M", "--align", path("first.ply")})));
  EXPECT_FALSE(std::filesystem::exists(fresh));
}

TEST_F(Align, WhatCannotBeDoneIsRefused) {
  EXPECT_TRUE(
      refuses(kUsage, "ingest", "magic",
              gdfmap({"ingest", map(), "--memory", "512M", "--align=magic", path("shifted.ply")})));
  EXPECT_TRUE(refuses(kUsage, "ingest", "remove that first",
                      gdfmap(align({"shifted.ply", "--replace=1"}))));
  EXPECT_TRUE(refuses(kUsage, "ingest", "standard input",
                      gdfmap({"ingest", map(), "--memory", "512M", "--align", "-"}, "1 2 3\n")));
}

}  // namespace
}  // namespace gdfmap::test
