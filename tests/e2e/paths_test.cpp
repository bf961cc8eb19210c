#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "e2e/expect.hpp"
#include "e2e/scene.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap::test {
namespace {

using Json = nlohmann::json;

/// A trained plane of 3 m × 3 m around the origin, at z = 0.
class Paths : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    directory_ = std::make_unique<TemporaryDirectory>();
    write_cloud(path("scan.ply"), square(0.0, 0.0, 0.0, 3.0, 20'000));
    ASSERT_TRUE(exits_with(0, gdfmap({"ingest", map(), path("scan.ply")})));
    ASSERT_TRUE(exits_with(0, gdfmap({"train", map()})));
  }
  static void TearDownTestSuite() { directory_.reset(); }

  static std::string path(const std::string& name) { return *directory_ / name; }
  static std::string map() { return path("a.gdfmap"); }
  static Json query(std::vector<std::string> options) {
    options.insert(options.begin(), {"query", map(), "--format", "json"});
    const Result result = gdfmap(options);
    EXPECT_TRUE(exits_with(0, result));
    return Json::parse(result.out);
  }
  static Json along(const std::vector<Vector3>& corners, const std::string& radius) {
    write_xyz(path("path.xyz"), corners);
    return query({"--along", path("path.xyz"), "--radius", radius});
  }

  static inline std::unique_ptr<TemporaryDirectory> directory_;
};

TEST_F(Paths, ARobotThatKeepsItsDistanceIsFree) {
  const Json json = along({{-1.0, 0.0, 1.0}, {0.0, 0.0, 0.6}, {1.0, 0.0, 1.0}}, "0.3");
  EXPECT_NEAR(json.at("distance").get<double>(), 0.6, 0.03);
  EXPECT_NEAR(json.at("x").get<double>(), 0.0, 0.1);
  EXPECT_EQ(json.at("status"), "fine");
  EXPECT_LE(json.at("lower_bound"), json.at("distance"));
  EXPECT_GT(json.at("lower_bound").get<double>(), 0.3);
  EXPECT_EQ(json.at("is_free"), true);
  EXPECT_EQ(json.at("free_length"), json.at("length"));
  EXPECT_EQ(json.at("unknown_length"), 0.0);
}

TEST_F(Paths, ARobotThatDoesNotIsToldHowFarItMayGo) {
  const Json json = along({{0.0, 0.0, 1.5}, {0.0, 0.0, 0.2}}, "0.5");
  EXPECT_EQ(json.at("is_free"), false);
  EXPECT_LE(json.at("free_length").get<double>(), 1.0);
  EXPECT_GT(json.at("free_length").get<double>(), 0.6);
}

TEST_F(Paths, RaysHitTheGroundAndTheSkyDoesNot) {
  const Json rays = query({"--ray", "0.1,0.2,1.5,0,0,-2", "--ray", "0.1,0.2,1.5,0,0,1",
                           "--max-range", "60", "--radius", "0.1"});
  ASSERT_EQ(rays.size(), 2u);
  EXPECT_EQ(rays[0].at("end"), "hit");
  EXPECT_NEAR(rays[0].at("range").get<double>(), 1.4, 0.05);
  EXPECT_NEAR(rays[0].at("hit_z").get<double>(), 0.1, 0.05);
  EXPECT_LE(rays[0].at("free_range"), rays[0].at("range"));
  EXPECT_EQ(rays[1].at("end"), "max_range");
  EXPECT_EQ(rays[1].at("range"), 60.0);
  EXPECT_EQ(rays[1].at("status"), "far");
}

TEST_F(Paths, TablesHaveAHeaderAndARowEach) {
  const Result rays = gdfmap({"query", map(), "--ray", "0,0,1,0,0,1", "--ray", "0,0,1,0,0,-1"});
  EXPECT_TRUE(exits_with(0, rays));
  EXPECT_TRUE(rays.out.starts_with(
      "x,y,z,dx,dy,dz,end,range,free_range,hit_x,hit_y,hit_z,distance,status\n0,0,1,0,0,1,"));
  EXPECT_EQ(std::ranges::count(rays.out, '\n'), 3);
  write_xyz(path("path.xyz"), std::vector<Vector3>{{0, 0, 1}, {0, 1, 1}});
  const Result along = gdfmap({"query", map(), "--along", path("path.xyz")});
  EXPECT_TRUE(exits_with(0, along));
  EXPECT_TRUE(along.out.starts_with(
      "length,distance,x,y,z,place_at,status,lower_bound,free_length,is_free,unknown_length\n1,"));
}

TEST_F(Paths, RefusesWhatMakesNoSense) {
  write_text(path("empty.xyz"), "x,y,z\n");
  const std::string at = "0,0,0";
  EXPECT_TRUE(refuses(2, "query", "--along and --ray",
                      gdfmap({"query", map(), "--at", at, "--radius", "1"})));
  EXPECT_TRUE(
      refuses(2, "query", "--max-range", gdfmap({"query", map(), "--at", at, "--max-range", "1"})));
  EXPECT_TRUE(
      refuses(2, "query", "one of", gdfmap({"query", map(), "--at", at, "--ray", "0,0,0,1,0,0"})));
  EXPECT_TRUE(refuses(2, "query", "direction", gdfmap({"query", map(), "--ray", "0,0,0,0,0,0"})));
  EXPECT_TRUE(refuses(2, "query", "direction", gdfmap({"query", map(), "--ray", "0,0,0"})));
  EXPECT_TRUE(refuses(2, "query", "npy",
                      gdfmap({"query", map(), "--ray", "0,0,0,1,0,0", "--format", "npy"})));
  EXPECT_TRUE(
      refuses(2, "query", "empty.xyz", gdfmap({"query", map(), "--along", path("empty.xyz")})));
  EXPECT_TRUE(
      refuses(3, "query", "none.csv", gdfmap({"query", map(), "--along", path("none.csv")})));
}

}  // namespace
}  // namespace gdfmap::test
