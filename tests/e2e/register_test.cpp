#include <filesystem>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "e2e/expect.hpp"
#include "support/lidar_room.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap::test {
namespace {

constexpr int kUsage = 2, kIo = 3, kCondition = 6;

Eigen::Isometry3d parse_transform(const std::string& text) {
  std::istringstream stream(text);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 16; ++i) stream >> T.matrix()(i / 4, i % 4);
  EXPECT_TRUE(stream.good());
  return T;
}

class Register : public ::testing::Test {
 protected:
  Register() {
    write_cloud(path("target.ply"), pair_.target);
    write_cloud(path("scan.ply"), pair_.source);
  }
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }
  [[nodiscard]] double metres_off(const Eigen::Isometry3d& T) const {
    return (T.inverse() * pair_.T_target_source).translation().norm();
  }

  TemporaryDirectory directory_;
  LidarPair pair_ = lidar_pair(0, LidarOptions{64, 512, 0.02});
};

TEST_F(Register, WritesThePoseOfAScanInACloud) {
  const Result result = gdfmap({"register", path("target.ply"), path("scan.ply"), "--out",
                                path("T.txt"), "--ply", path("aligned.xyz")});
  ASSERT_TRUE(exits_with(0, result));
  const std::string text = read_file(path("T.txt"));
  const Eigen::Isometry3d T = parse_transform(text);
  EXPECT_LT(metres_off(T), 0.005);
  EXPECT_NE(result.out.find(text), std::string::npos);

  std::istringstream aligned(read_file(path("aligned.xyz")));
  Vector3 first;
  aligned >> first.x() >> first.y() >> first.z();
  EXPECT_LT((first - T * pair_.source.front()).norm(), 1e-9);
}

TEST_F(Register, FindsTheSamePoseInAMapWithoutChangingIt) {
  ASSERT_TRUE(exits_with(0, gdfmap({"ingest", path("a.gdfmap"), path("target.ply")})));
  const std::string before = read_file(directory_.path() / "a.gdfmap" / "points.db");
  const Result result = gdfmap({"register", path("a.gdfmap"), path("scan.ply"), "--json",
                                "--stride", "2", "--init", "0.2,-0.1,0,0,0,3", "--memory", "64M"});
  ASSERT_TRUE(exits_with(0, result));
  const auto report = nlohmann::json::parse(result.out);
  EXPECT_EQ(report.at("status"), "converged");
  EXPECT_GT(report.at("inlier_ratio"), 0.8);
  EXPECT_EQ(report.at("covariance").size(), 6u);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (std::size_t r = 0; r < 4; ++r) {
    for (std::size_t c = 0; c < 4; ++c) {
      T.matrix()(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) =
          report.at("T_target_source").at(r).at(c);
    }
  }
  EXPECT_LT(metres_off(T), 0.005);
  EXPECT_EQ(read_file(directory_.path() / "a.gdfmap" / "points.db"), before);
}

TEST_F(Register, APoseThatCannotBeTrustedIsReportedAndNotWritten) {
  const Result result = gdfmap({"register", path("target.ply"), path("scan.ply"), "--init",
                                "50,0,0,0,0,0", "--out", path("T.txt"), "--json"});
  EXPECT_TRUE(refuses(kCondition, "register", "rejected", result));
  EXPECT_EQ(nlohmann::json::parse(result.out).at("status"), "rejected");
  EXPECT_FALSE(std::filesystem::exists(path("T.txt")));
}

TEST_F(Register, RefusesWhatItCannotUse) {
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"register", path("target.ply"), path("scan.ply")});
    return gdfmap(more);
  };
  EXPECT_TRUE(refuses(kUsage, "register", "--method", with({"--method", "magic"})));
  EXPECT_TRUE(refuses(kUsage, "register", "--init", with({"--init", "1,2,3"})));
  EXPECT_TRUE(refuses(kUsage, "register", "--init", with({"--init", "missing.txt"})));
  EXPECT_TRUE(refuses(kUsage, "register", "--voxel", with({"--voxel", "0"})));
  EXPECT_TRUE(refuses(kIo, "register", "missing.ply",
                      gdfmap({"register", path("missing.ply"), path("scan.ply")})));
  EXPECT_TRUE(refuses(kIo, "register", "missing.gdfmap",
                      gdfmap({"register", path("missing.gdfmap"), path("scan.ply")})));
}

}  // namespace
}  // namespace gdfmap::test
