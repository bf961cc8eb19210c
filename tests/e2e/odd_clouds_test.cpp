#include <cmath>

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

class OddClouds : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }

  Json json_of(const std::vector<std::string>& command) {
    const Result result = gdfmap(command);
    EXPECT_TRUE(exits_with(0, result));
    return Json::parse(result.out);
  }
  /// Ingests points into a new map and returns the report.
  Json ingest(const std::string& map, const std::vector<Vector3>& points) {
    write_xyz(path(map + ".xyz"), points);
    return json_of({"ingest", path(map), path(map + ".xyz"), "--json"});
  }
  void train(const std::string& map) { EXPECT_TRUE(exits_with(0, gdfmap({"train", path(map)}))); }
  /// The answer at a point.
  Json query(const std::string& map, const std::string& at) {
    return json_of({"query", path(map), "--format", "json", "--at", at}).at(0);
  }

  TemporaryDirectory directory_;
};

TEST_F(OddClouds, PointsThatAreNotFiniteAreCountedAndLeftOut) {
  std::vector<Vector3> points = first_scan();
  const std::size_t num_finite = points.size();
  ingest("clean.gdfmap", points);
  points.insert(points.begin() + 100, {NAN, 0.0, 0.0});
  points.insert(points.begin() + 900, {0.0, INFINITY, 0.0});
  points.insert(points.begin() + 901, {0.0, 0.0, -INFINITY});
  write_cloud(path("odd.ply"), points);
  const Json report = json_of({"ingest", path("odd.gdfmap"), path("odd.ply"), "--json"});
  EXPECT_EQ(report.at("num_read"), points.size());
  EXPECT_EQ(report.at("num_rejected").at("not_finite"), 3);
  EXPECT_EQ(
      report.at("num_stored").get<std::size_t>() + report.at("num_duplicates").get<std::size_t>(),
      num_finite);
  EXPECT_EQ(json_of({"info", path("odd.ply"), "--json"}).at("num_finite"), num_finite);
  train("clean.gdfmap");
  train("odd.gdfmap");
  EXPECT_EQ(bytes_of(path("odd.gdfmap")), bytes_of(path("clean.gdfmap")));
}

TEST_F(OddClouds, OnePointFarAwayCostsOneTileAndNothingElse) {
  std::vector<Vector3> points = first_scan();
  ingest("near.gdfmap", points);
  points.insert(points.begin() + 5, {1e7, -3.0, 2.0});
  ingest("far.gdfmap", points);
  train("near.gdfmap");
  train("far.gdfmap");
  const Json near = json_of({"info", path("near.gdfmap"), "--json"});
  const Json far = json_of({"info", path("far.gdfmap"), "--json"});
  EXPECT_EQ(far.at("points").at("num_tiles"), near.at("points").at("num_tiles").get<int>() + 1);
  EXPECT_EQ(far.at("points").at("num_points"), near.at("points").at("num_points").get<int>() + 1);
  EXPECT_LT(far.at("num_bytes"), 2 * near.at("num_bytes").get<std::uint64_t>());

  const Result refused = gdfmap({"export", path("far.gdfmap"), path("far.bin")});
  EXPECT_TRUE(refuses(2, "export", "--region", refused));
  EXPECT_FALSE(std::filesystem::exists(path("far.bin")));

  const std::string region = "-20,-20,-20,20,20,20";
  for (const char* map : {"near", "far"}) {
    EXPECT_TRUE(exits_with(0, gdfmap({"export", path(std::string(map) + ".gdfmap"),
                                      path(std::string(map) + ".bin"), "--region", region})));
  }
  EXPECT_EQ(read_file(path("far.bin")), read_file(path("near.bin")));
  EXPECT_EQ(query("far.gdfmap", "1e7,-3,2").at("status"), "fine");
}

TEST_F(OddClouds, AnEmptyCloudMakesAnEmptyMapThatCanBeTrained) {
  write_cloud(path("empty.ply"), {});
  const Json report = json_of({"ingest", path("a.gdfmap"), path("empty.ply"), "--json"});
  EXPECT_EQ(report.at("num_read"), 0);
  EXPECT_EQ(report.at("sources").size(), 1u);
  const Json trained = json_of({"train", path("a.gdfmap"), "--json"});
  EXPECT_EQ(trained.at("num_cubes_fitted"), 0);
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", path("a.gdfmap")})));
  EXPECT_TRUE(
      refuses(2, "query", "no cubes", gdfmap({"query", path("a.gdfmap"), "--at", "0,0,0"})));
  EXPECT_TRUE(
      refuses(2, "export", "no cubes", gdfmap({"export", path("a.gdfmap"), path("a.bin")})));
}

TEST_F(OddClouds, AFileWithoutAByteIsRefusedSinceItHasNoFormat) {
  write_text(path("empty.xyz"), "");
  EXPECT_TRUE(refuses(4, "ingest", "empty.xyz: is empty",
                      gdfmap({"ingest", path("a.gdfmap"), path("empty.xyz")})));
  EXPECT_FALSE(std::filesystem::exists(path("a.gdfmap")));
}

TEST_F(OddClouds, OnePointHasTheDistanceFieldOfAPoint) {
  ingest("a.gdfmap", {{0.4, 0.6, 0.5}});
  train("a.gdfmap");
  EXPECT_NEAR(query("a.gdfmap", "1.4,0.6,0.5").at("distance").get<double>(), 1.0, 0.1);
  EXPECT_NEAR(query("a.gdfmap", "0.4,0.6,0.5").at("distance").get<double>(), 0.0, 0.25);
  EXPECT_EQ(query("a.gdfmap", "0.4,0.6,0.9").at("status"), "fine");
  const Json far = query("a.gdfmap", "50,0.6,0.5");
  EXPECT_EQ(far.at("status"), "far");
  EXPECT_LE(far.at("distance").get<double>(), 49.6);
  EXPECT_GE(far.at("distance").get<double>(), 48.0);
}

TEST_F(OddClouds, IdenticalPointsAreOnePoint) {
  const Json report = ingest("many.gdfmap", std::vector<Vector3>(1000, Vector3(0.4, 0.6, 0.5)));
  EXPECT_EQ(report.at("num_stored"), 1);
  EXPECT_EQ(report.at("num_duplicates"), 999);
  ingest("one.gdfmap", {{0.4, 0.6, 0.5}});
  train("many.gdfmap");
  train("one.gdfmap");
  EXPECT_EQ(content_digest_of(path("many.gdfmap")), content_digest_of(path("one.gdfmap")));
}

TEST_F(OddClouds, PointsInAPlaneHaveTheDistanceToThePlane) {
  ingest("a.gdfmap", square(0.5, 0.5, 0.5, 3.0, 20000));  // the plane halves a layer of cubes
  train("a.gdfmap");
  for (const double height : {0.1, 0.5, 0.8, 1.3}) {
    const Json answer = query("a.gdfmap", "0.5,0.5," + std::to_string(height));
    EXPECT_EQ(answer.at("status"), "fine");
    EXPECT_NEAR(answer.at("distance").get<double>(), std::abs(height - 0.5), 0.05) << height;
  }
  EXPECT_NEAR(query("a.gdfmap", "0.5,0.5,1.2").at("gz").get<double>(), 1.0, 0.1);
}

TEST_F(OddClouds, PointsOnTheFacesOfTilesAreStoredOnce) {
  const std::vector<Vector3> corners = {{0, 0, 0}, {8, 0, 0}, {0, -8, 0}, {8, 8, 8}, {-8, 0, 8}};
  const Json report = ingest("a.gdfmap", corners);
  EXPECT_EQ(report.at("num_stored"), corners.size());
  train("a.gdfmap");
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", path("a.gdfmap")})));
}

TEST_F(OddClouds, AThousandZerosAreWarnedOfAndDroppedOnRequest) {
  std::vector<Vector3> points = first_scan();
  points.insert(points.end(), 1000, Vector3::Zero());
  write_xyz(path("scan.xyz"), points);
  const Result warned = gdfmap({"ingest", path("kept.gdfmap"), path("scan.xyz"), "--quiet"});
  EXPECT_TRUE(exits_with(0, warned));
  EXPECT_NE(warned.err.find("--drop-zero"), std::string::npos) << warned.err;
  const Json report =
      json_of({"ingest", path("b.gdfmap"), path("scan.xyz"), "--drop-zero", "--json"});
  EXPECT_EQ(report.at("num_rejected").at("zero"), 1000);
}

}  // namespace
}  // namespace gdfmap::test
