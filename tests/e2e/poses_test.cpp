// Scans with poses, and where their sensors stood.

#include <filesystem>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "e2e/expect.hpp"
#include "e2e/map_bytes.hpp"
#include "e2e/scene.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap::test {
namespace {

using Json = nlohmann::json;

constexpr int kUsage = 2;
constexpr int kIo = 3;

/// One scan on disk twice, once where the sensor saw it and once where it is.
class Poses : public ::testing::Test {
 protected:
  Poses() {
    const std::vector<Vector3> scan = first_scan();
    write_xyz(path("scan0.xyz"), scan);
    write_xyz(path("scan1.xyz"), second_scan());
    write_text(path("kitti.txt"), "1 0 0 0.5 0 1 0 -0.25 0 0 1 0\n0 -1 0 2 1 0 0 3 0 0 1 0.5\n");
    write_text(path("tum.txt"),
               "# time x y z qx qy qz qw\n10.5 0.5 -0.25 0 0 0 0 1\n"
               "10.6 2 3 0.5 0 0 0.70710678118654757 0.70710678118654757\n");
  }
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }

  [[nodiscard]] Result ingest(const std::string& map, const std::vector<std::string>& options,
                              const std::vector<std::string>& clouds = {"scan0.xyz",
                                                                        "scan1.xyz"}) const {
    std::vector<std::string> command = {"ingest", path(map)};
    for (const std::string& cloud : clouds) command.push_back(path(cloud));
    command.insert(command.end(), options.begin(), options.end());
    return gdfmap(command);
  }
  [[nodiscard]] Json sources(const std::string& map) const {
    const Result result = gdfmap({"sources", path(map), "--json"});
    EXPECT_TRUE(exits_with(0, result));
    return Json::parse(result.out).at("sources");
  }

  TemporaryDirectory directory_;
};

TEST_F(Poses, EachScanIsIngestedWhereItsPosePutsIt) {
  ASSERT_TRUE(exits_with(0, ingest("posed.gdfmap", {"--poses", path("kitti.txt")})));
  write_text(path("T0.txt"), "1 0 0 0.5 0 1 0 -0.25 0 0 1 0 0 0 0 1");
  write_text(path("T1.txt"), "0 -1 0 2 1 0 0 3 0 0 1 0.5 0 0 0 1");
  for (const char* const i : {"0", "1"}) {
    ASSERT_TRUE(
        exits_with(0, ingest("moved.gdfmap", {"--transform", path(std::string("T") + i + ".txt")},
                             {std::string("scan") + i + ".xyz"})));
  }
  const Json posed = sources("posed.gdfmap"), moved = sources("moved.gdfmap");
  ASSERT_EQ(posed.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(posed[i].at("identity"), moved[i].at("identity"));
    EXPECT_TRUE(moved[i].at("sensor_origin").is_null());
  }
  EXPECT_EQ(posed[0].at("sensor_origin"), (Json{0.5, -0.25, 0.0}));
  EXPECT_EQ(posed[1].at("sensor_origin"), (Json{2.0, 3.0, 0.5}));
  for (const char* const map : {"posed.gdfmap", "moved.gdfmap"}) {
    ASSERT_TRUE(exits_with(0, gdfmap({"train", path(map)})));
  }
  EXPECT_EQ(bytes_of(path("posed.gdfmap")), bytes_of(path("moved.gdfmap")));
  const Result text = gdfmap({"sources", path("posed.gdfmap")});
  EXPECT_NE(text.out.find("sensor at"), std::string::npos) << text.out;
}

TEST_F(Poses, TumAndKittiSayTheSame) {
  ASSERT_TRUE(exits_with(0, ingest("kitti.gdfmap", {"--poses", path("kitti.txt")})));
  ASSERT_TRUE(exits_with(0, ingest("tum.gdfmap", {"--poses", path("tum.txt")})));
  const Json kitti = sources("kitti.gdfmap"), tum = sources("tum.gdfmap");
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(kitti[i].at("sensor_origin"), tum[i].at("sensor_origin"));
    EXPECT_EQ(kitti[i].at("num_stored"), tum[i].at("num_stored"));
  }
}

TEST_F(Poses, TheTransformComesAfterThePoseAndTheScaleBeforeIt) {
  write_text(path("T.txt"), "1 0 0 100 0 1 0 0 0 0 1 0 0 0 0 1");
  ASSERT_TRUE(
      exits_with(0, ingest("m.gdfmap", {"--poses", path("kitti.txt"), "--transform", path("T.txt"),
                                        "--scale", "0.5", "--sensor-origin", "2,0,0"})));
  // A lever arm of 2 units is 1 m along the sensor's x, which the second pose turns to y.
  EXPECT_EQ(sources("m.gdfmap")[0].at("sensor_origin"), (Json{101.5, -0.25, 0.0}));
  EXPECT_EQ(sources("m.gdfmap")[1].at("sensor_origin"), (Json{102.0, 4.0, 0.5}));
}

TEST_F(Poses, BadPosesAreRefusedBeforeAMapIsMade) {
  const auto refused = [&](int exit_code, const std::string& text, const std::string& fragment) {
    write_text(path("bad.txt"), text);
    EXPECT_TRUE(
        refuses(exit_code, "ingest", fragment, ingest("m.gdfmap", {"--poses", path("bad.txt")})));
    EXPECT_FALSE(std::filesystem::exists(path("m.gdfmap")));
  };
  const std::string good = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  refused(kUsage, good, "bad.txt: it holds 1 poses for 2 clouds");
  refused(kUsage, good + good + good, "bad.txt: it holds 3 poses for 2 clouds");
  refused(kUsage, good + "1 0 0 0 0 1 0 0 0 0 nan 0\n", "bad.txt: line 2: 'nan'");
  refused(kUsage, good + "0 1 2 3 0 0 0 1\n", "bad.txt: line 2: it has 8 columns");
  refused(kUsage, good + "0 0 0 1 2 3\n", "bad.txt: line 2: it has 6 columns");
  refused(kUsage, "3 0 0 0 0 3 0 0 0 0 3 0\n" + good, "bad.txt: line 1: the left 3 x 3");
  refused(kUsage, "0 1 2 3 0 0 0 1\n0 1 2 3 1 0 0 1\n", "bad.txt: line 2: its quaternion");
  EXPECT_TRUE(
      refuses(kIo, "ingest", "none.txt", ingest("m.gdfmap", {"--poses", path("none.txt")})));
  EXPECT_TRUE(
      refuses(kUsage, "ingest", "--sensor-origin", ingest("m.gdfmap", {"--sensor-origin", "1,2"})));
  EXPECT_FALSE(std::filesystem::exists(path("m.gdfmap")));
}

TEST_F(Poses, ThePlaceOfAViewpointIsKeptAndItsRotationLeftAloneWithAWarning) {
  write_text(path("view.pcd"),
             "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
             "VIEWPOINT 1 2 3 0 0 0 1\nPOINTS 2\nDATA ascii\n0.1 0.2 0.3\n4.1 0.2 0.3\n");
  const Result result = ingest("m.gdfmap", {"--scale", "2"}, {"view.pcd"});
  ASSERT_TRUE(exits_with(0, result));
  EXPECT_NE(result.err.find("its points are taken as they stand"), std::string::npos) << result.err;
  EXPECT_EQ(sources("m.gdfmap")[0].at("sensor_origin"), (Json{2.0, 4.0, 6.0}));
  const Result info = gdfmap({"info", path("m.gdfmap"), "--json"});
  // (0.2, 0.4, 0.6) and (8.2, 0.4, 0.6): two tiles, not turned to −x.
  EXPECT_EQ(Json::parse(info.out).at("points").at("num_tiles"), 2);
  const Result quiet =
      ingest("m.gdfmap", {"--scale", "2", "--sensor-origin", "0,0,9"}, {"view.pcd"});
  ASSERT_TRUE(exits_with(0, quiet));
  EXPECT_NE(quiet.out.find("where the sensor stood"), std::string::npos) << quiet.out;
  EXPECT_EQ(sources("m.gdfmap").size(), 1U);
  EXPECT_EQ(sources("m.gdfmap")[0].at("sensor_origin"), (Json{0.0, 0.0, 18.0}));
}

}  // namespace
}  // namespace gdfmap::test
