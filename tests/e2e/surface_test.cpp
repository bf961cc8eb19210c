#include <filesystem>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <gdfmap/db/database.hpp>

#include "e2e/expect.hpp"
#include "e2e/scene.hpp"
#include "support/map_fixture.hpp"
#include "support/ply_file.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap::test {
namespace {

class Surface : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }
  std::string trained_map() {
    write_cloud(path("scan.ply"), first_scan());
    EXPECT_TRUE(exits_with(0, gdfmap({"ingest", path("a.gdfmap"), path("scan.ply")})));
    EXPECT_TRUE(exits_with(0, gdfmap({"train", path("a.gdfmap")})));
    return path("a.gdfmap");
  }
  /// Whether nothing of an output is there, no temporary file either.
  [[nodiscard]] bool is_gone(const std::string& name) const {
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path())) {
      if (entry.path().filename().string().starts_with(name)) return false;
    }
    return true;
  }

  TemporaryDirectory directory_;
};

TEST_F(Surface, WritesPointsAndMeshes) {
  const std::string map = trained_map();
  const Result points = gdfmap({"surface", map, path("p.ply"), "--json"});
  ASSERT_TRUE(exits_with(0, points));
  const auto json = nlohmann::json::parse(points.out);
  EXPECT_EQ(json["num_points"], read_ply(path("p.ply")).num_vertices());
  EXPECT_GT(json["num_points"], 1000u);
  EXPECT_GT(json["num_samples"], json["num_points"]);

  const Result projected =
      gdfmap({"surface", map, path("q.ply"), "--points", "--project", "--json"});
  ASSERT_TRUE(exits_with(0, projected));
  const PlyFile file = read_ply(path("q.ply"));
  EXPECT_EQ(file.values.count("expected_error"), 1u);
  const auto report = nlohmann::json::parse(projected.out);
  EXPECT_EQ(report["num_points"], file.num_vertices());
  EXPECT_EQ(report["num_points"].get<std::size_t>() + report["num_left_out"].get<std::size_t>(),
            json["num_points"].get<std::size_t>());

  const Result mesh = gdfmap({"surface", map, path("m.ply"), "--mesh", "--json"});
  ASSERT_TRUE(exits_with(0, mesh));
  EXPECT_EQ(nlohmann::json::parse(mesh.out)["num_triangles"],
            read_ply(path("m.ply")).triangles.size());
  EXPECT_TRUE(exits_with(0, gdfmap({"surface", map, path("m.obj"), "--mesh", "--shell"})));
  EXPECT_EQ(read_file(path("m.obj")).substr(0, 2), "v ");
}

TEST_F(Surface, TakesTheAncestorsConfiguration) {
  const std::string map = trained_map();
  EXPECT_TRUE(exits_with(0, gdfmap({"export", map, path("a.bin")})));
  write_text(path("r.yaml"), "io:\n  input_csv: " + path("a.bin") +
                                 "\n  output_ply: " + path("r.ply") +
                                 "\nreconstruction: {threshold: 0.1, resolution: 0.05, max_mae: "
                                 "0.2}\nblending: {enabled: true, margin: 0.2}\n");
  const Result result = gdfmap({"surface", "-c", path("r.yaml")});
  ASSERT_TRUE(exits_with(0, result));
  EXPECT_NE(result.err.find("blending.margin has no effect"), std::string::npos);
  EXPECT_TRUE(exits_with(0, gdfmap({"surface", path("a.bin"), path("s.ply"), "--threshold", "0.1",
                                    "--resolution", "0.05", "--sigmas", "0"})));
  EXPECT_TRUE(read_file(path("r.ply")) == read_file(path("s.ply")));
  EXPECT_TRUE(exits_with(0, gdfmap({"surface", "-c", path("r.yaml"), "--sigmas", "1"})));
  EXPECT_LT(read_ply(path("r.ply")).num_vertices(), read_ply(path("s.ply")).num_vertices());
}

TEST_F(Surface, RefusesWhatItCannotDoAndLeavesNothing) {
  const std::string map = trained_map();
  const auto refused = [&](std::vector<std::string> arguments, const std::string& fragment) {
    arguments.insert(arguments.begin(), "surface");
    EXPECT_TRUE(refuses(2, "surface", fragment, gdfmap(arguments)));
  };
  refused({}, "a map and a file");
  refused({map}, "a map and a file");
  refused({map, path("x.las")}, ".ply");
  refused({map, path("x.stl"), "--mesh"}, ".obj");
  refused({map, path("x.ply"), "--threshold", "3"}, "threshold");
  refused({map, path("x.ply"), "--resolution", "2"}, "resolution");
  refused({map, path("x.ply"), "--region", "1,1,1,0,0,0"}, "--region");
  refused({map, path("x.ply"), "--region", "90,90,90,91,91,91"}, "region");
  refused({map, path("x.ply"), "--mesh", "--project"}, "--project");
  refused({map, path("x.ply"), "--shell"}, "--mesh");
  refused({map, path("x.ply"), "--mesh", "--resolution", "0.1"}, "between the samples");
  refused({map, path("x.ply"), "-c", path("r.yaml")}, "--config");
  EXPECT_TRUE(is_gone("x."));
  EXPECT_TRUE(refuses(3, "surface", "none.gdfmap",
                      gdfmap({"surface", path("none.gdfmap"), path("x.ply")})));
  EXPECT_TRUE(
      refuses(3, "surface", "nowhere", gdfmap({"surface", map, path("nowhere/x.ply"), "--mesh"})));
  EXPECT_TRUE(exits_with(0, gdfmap({"ingest", path("b.gdfmap"), path("scan.ply")})));
  refused({path("b.gdfmap"), path("x.ply")}, "gdfmap train");
  EXPECT_TRUE(is_gone("x."));
}

TEST_F(Surface, SaysWhereATileCannotBeRead) {
  const std::string map = trained_map();
  {
    db::Database cubes(map + "/cubes.db", db::OpenMode::kWrite);
    cubes.execute(
        "UPDATE tile_blobs SET data = zeroblob(length(data)) WHERE tile = (SELECT id FROM tiles "
        "WHERE "
        "level = 0 AND num_cubes > 0 ORDER BY x, y, z LIMIT 1)");
  }
  const Result result = gdfmap({"surface", map, path("p.ply")});
  EXPECT_TRUE(exits_with(4, result));
  EXPECT_NE(result.err.find("could not be read, the surface has gaps there"), std::string::npos);
  EXPECT_GT(read_ply(path("p.ply")).num_vertices(), 100u);
}

TEST_F(Surface, NothingWithinTheThresholdIsSaid) {
  const Result result =
      gdfmap({"surface", trained_map(), path("p.ply"), "--max-mae", "0", "--quiet"});
  ASSERT_TRUE(exits_with(0, result));
  EXPECT_NE(result.err.find("nothing is within the threshold"), std::string::npos);
  EXPECT_EQ(read_ply(path("p.ply")).num_vertices(), 0u);
}

}  // namespace
}  // namespace gdfmap::test
