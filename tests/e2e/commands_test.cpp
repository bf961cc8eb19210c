#include <algorithm>
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

class Commands : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }
  Json json_of(std::vector<std::string> command) {
    command.emplace_back("--json");
    const Result result = gdfmap(command);
    EXPECT_TRUE(exits_with(0, result));
    return Json::parse(result.out);
  }
  static void succeed(const std::vector<std::string>& command) {
    EXPECT_TRUE(exits_with(0, gdfmap(command)));
  }
  std::string trained_map() {
    write_cloud(path("scan.ply"), first_scan());
    succeed({"ingest", path("a.gdfmap"), path("scan.ply")});
    succeed({"train", path("a.gdfmap")});
    return path("a.gdfmap");
  }

  TemporaryDirectory directory_;
};

void expect_keys(const Json& json, const std::vector<std::string>& keys) {
  for (const std::string& key : keys) EXPECT_TRUE(json.contains(key)) << key << " in " << json;
}

TEST_F(Commands, EveryHelpHasADescriptionOptionsAndAnExample) {
  for (const char* subcommand :
       {"ingest", "train", "query", "tile", "slice", "surface", "export", "import", "evaluate",
        "info", "sources", "remove", "verify", "compact", "build", "synth", "register"}) {
    const Result result = gdfmap({subcommand, "--help"});
    EXPECT_TRUE(exits_with(0, result)) << subcommand;
    for (const std::string& part :
         {std::string("Usage: gdfmap ") + subcommand, std::string("Examples:\n  "),
          std::string("gdfmap ") + subcommand + " ", std::string("Options:")}) {
      EXPECT_NE(result.out.find(part), std::string::npos) << subcommand << " lacks " << part;
    }
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
  }
}

TEST_F(Commands, VersionTellsVersionCommitAndInstructionSet) {
  const Result result = gdfmap({"--version"});
  EXPECT_TRUE(exits_with(0, result));
  for (const char* part : {"gdfmap 0.", "\ncommit ", "\ninstruction set "}) {
    EXPECT_NE(result.out.find(part), std::string::npos) << result.out;
  }
}

TEST_F(Commands, IngestCountsEveryPoint) {
  write_xyz(path("a.xyz"), first_scan());
  write_xyz(path("b.xyz"), second_scan());
  const Json json = json_of({"ingest", path("a.gdfmap"), path("a.xyz"), path("b.xyz")});
  expect_keys(json, {"num_read", "num_stored", "num_duplicates", "num_thinned", "num_rejected",
                     "sources", "estimate"});
  EXPECT_EQ(json.at("num_read"), first_scan().size() + second_scan().size());
  EXPECT_EQ(json.at("sources").size(), 2u);
  EXPECT_EQ(json.at("sources")[1].at("num_read"), second_scan().size());
  std::uint64_t accounted = 0;
  for (const char* key : {"num_stored", "num_duplicates", "num_thinned"}) {
    accounted += json.at(key).get<std::uint64_t>();
  }
  for (const auto& [reason, count] : json.at("num_rejected").items()) {
    accounted += count.get<std::uint64_t>();
  }
  EXPECT_EQ(json.at("num_read"), accounted);
  EXPECT_GT(json.at("estimate").at("num_cubes"), 0);
}

TEST_F(Commands, IngestScalesAndTransforms) {
  write_xyz(path("feet.xyz"), std::vector<Vector3>{{10, 20, 30}});
  write_text(path("turn.txt"), "0 -1 0 100\n1 0 0 200\n0 0 1 300\n0 0 0 1\n");
  succeed({"ingest", path("a.gdfmap"), path("feet.xyz"), "--scale", "0.5", "--transform",
           path("turn.txt")});
  // (10, 20, 30) / 2, a quarter turn about z, then the translation.
  const Json tile = json_of({"tile", path("a.gdfmap"), "--at", "90,205,315"});
  EXPECT_EQ(tile.at("num_points"), 1);
  EXPECT_EQ(tile.at("trained"), false);
}

TEST_F(Commands, TrainReportsItsCubes) {
  write_cloud(path("scan.ply"), first_scan());
  succeed({"ingest", path("a.gdfmap"), path("scan.ply")});
  const Json first = json_of({"train", path("a.gdfmap")});
  expect_keys(first, {"num_cubes_fitted", "num_cubes_unchanged", "num_cubes_failed",
                      "cubes_per_second", "seconds"});
  EXPECT_GT(first.at("num_cubes_fitted"), 50);
  EXPECT_EQ(first.at("num_cubes_failed"), 0);
  EXPECT_EQ(json_of({"train", path("a.gdfmap")}).at("num_cubes_fitted"), 0);
}

TEST_F(Commands, TrainEndsWithAConditionWhileACubeHasNoFit) {
  const std::string map = trained_map();
  {
    Map writer = Map::open(map, Access::kWrite);
    TileRecord tile = *writer.cubes().read({0, 0, 0, 0});
    tile.cubes[0].status = CubeStatus::kFailed;
    tile.cubes[0].failure = FailureReason::kNotFinite;
    tile.cubes[0].gaussians = {};
    writer.cubes().put(std::span(&tile, 1));
  }
  const Result result = gdfmap({"train", map, "--json"});
  EXPECT_TRUE(refuses(6, "train", "cubes without a fit", result));
  EXPECT_EQ(Json::parse(result.out).at("num_tiles_trained"), 0);
  EXPECT_TRUE(exits_with(0, gdfmap({"query", map, "--at", "0.1,0.1,0.1"})));
}

TEST_F(Commands, InfoOfAMapCountsWhatTrainFitted) {
  const std::string map = trained_map();
  const Json json = json_of({"info", map});
  expect_keys(json, {"content_digest", "cube_size", "margin", "num_bytes", "points", "cubes"});
  EXPECT_EQ(json.at("trained"), true);
  EXPECT_EQ(json.at("points").at("num_points"), first_scan().size());
  const Json& cubes = json.at("cubes");
  EXPECT_EQ(cubes.at("num_cubes"),
            cubes.at("num_populated").get<int>() + cubes.at("num_empty").get<int>());
  EXPECT_EQ(json_of({"verify", map}).at("content_digest"), json.at("content_digest"));
  EXPECT_EQ(json_of({"verify", map}).at("faults"), Json::array());
}

TEST_F(Commands, InfoOfACloudReadsEveryPoint) {
  write_cloud(path("scan.ply"), std::vector<Vector3>{{1, 2, 3}, {-4, 5, 6}, {NAN, 0, 0}});
  const Json json = json_of({"info", path("scan.ply")});
  EXPECT_EQ(json.at("num_points"), 3);
  EXPECT_EQ(json.at("num_finite"), 2);
  EXPECT_EQ(json.at("bounds_min"), Json({-4.0, 2.0, 3.0}));
  EXPECT_EQ(json.at("bounds_max"), Json({1.0, 5.0, 6.0}));
  EXPECT_EQ(json.at("format"), "PLY binary_little_endian");
}

TEST_F(Commands, TileListsAndLooksIn) {
  const std::string map = trained_map();
  const Json listed = json_of({"tile", map, "--list"}).at("tiles");
  EXPECT_EQ(std::count_if(listed.begin(), listed.end(),
                          [](const Json& tile) { return tile.at("level") == 0; }),
            8);
  const Json tile = json_of({"tile", map, "--at", "0.1,0.1,0.1"});
  EXPECT_EQ(json_of({"tile", map, "--key", "0,0,0,0"}), tile);
  EXPECT_EQ(tile.at("cubes").size(), tile.at("num_cubes"));
  EXPECT_EQ(tile.at("cubes")[0].at("status"), "fitted");
  EXPECT_GT(tile.at("num_points"), 0);
  const Json nothing = json_of({"tile", map, "--at", "5000,0,0"});
  EXPECT_EQ(nothing.at("trained"), false);
  EXPECT_EQ(nothing.at("cubes"), Json::array());
}

TEST_F(Commands, ExportAndImportGiveTheSameFieldBack) {
  const std::string map = trained_map();
  for (const char* extension : {".bin", ".csv"}) {
    const std::string model = path(std::string("model") + extension);
    const Json exported = json_of({"export", map, model});
    EXPECT_GT(exported.at("num_cubes"), 50);
    const std::string imported = path(std::string("imported") + extension + ".gdfmap");
    EXPECT_EQ(json_of({"import", imported, model}).at("num_cubes"), exported.at("num_cubes"));
    succeed({"export", imported, path("again.bin")});
    EXPECT_EQ(json_of({"info", path("again.bin")}).at("num_gaussians"),
              exported.at("num_gaussians"));
    const Result of_model = gdfmap({"query", model, "--at", "0.1,0.2,0.4"});
    EXPECT_TRUE(exits_with(0, of_model));
    EXPECT_EQ(gdfmap({"query", imported, "--at", "0.1,0.2,0.4"}).out, of_model.out);
  }
  EXPECT_EQ(json_of({"info", path("model.bin")}).at("format"), "GDF1");
  EXPECT_EQ(json_of({"info", path("model.csv")}).at("format"), "CSV");
}

TEST_F(Commands, EvaluateReportsErrorsOfTheFieldAndOfItsParts) {
  const std::string map = trained_map();
  const std::vector<std::string> keys = {"mae",
                                         "median",
                                         "rmse",
                                         "p95",
                                         "max",
                                         "gradient_norm_mean",
                                         "gradient_norm_std",
                                         "gradient_angle_mean_deg",
                                         "num_samples"};
  const Json json = json_of({"evaluate", map, "--samples", "5000"});
  expect_keys(json, keys);
  expect_keys(json, {"num_fine", "num_coarse", "num_far", "num_unknown", "num_set_aside",
                     "mean_expected_error"});
  for (const char* part : {"populated", "empty", "outer_shell"}) expect_keys(json.at(part), keys);
  for (const Json& band : json.at("bands")) {
    expect_keys(band, keys);
    expect_keys(band, {"min_distance", "max_distance"});
  }
  expect_keys(json.at("levels").at(0), keys);
  EXPECT_EQ(json.at("levels").at(0).at("level"), 0);
  EXPECT_GT(json.at("num_samples"), 1000);
  EXPECT_LT(json.at("mae"), 0.03);

  succeed({"export", map, path("model.bin")});
  const Json stepped = json_of(
      {"evaluate", path("model.bin"), path("scan.ply"), "--step", "0.1", "--blend", "gdf1"});
  EXPECT_LT(stepped.at("mae"), 0.03);
  EXPECT_TRUE(refuses(2, "evaluate", "", gdfmap({"evaluate", path("model.bin")})));
}

TEST_F(Commands, InfoDrawsAMapFromAbove) {
  const std::string map = trained_map();
  succeed({"info", map, "--plot", path("above.png")});
  EXPECT_EQ(read_file(path("above.png")).substr(1, 3), "PNG");
  EXPECT_TRUE(refuses(2, "info", "scan.ply",
                      gdfmap({"info", path("scan.ply"), "--plot", path("cloud.png")})));
}

TEST_F(Commands, EvaluateWritesAMapAndAPlotOfTheErrors) {
  const std::string map = trained_map();
  succeed({"evaluate", map, "--samples", "2000", "--map", path("e.ply"), "--plot", path("e.png")});
  EXPECT_EQ(json_of({"info", path("e.ply")}).at("num_finite"), 2000);
  EXPECT_EQ(read_file(path("e.png")).substr(1, 3), "PNG");
  EXPECT_TRUE(refuses(2, "evaluate", "e.las", gdfmap({"evaluate", map, "--map", path("e.las")})));
}

TEST_F(Commands, EvaluateKnowsTheTruthOfASyntheticScene) {
  succeed({"synth", "plane", path("plane.ply"), "--points", "40000", "--size", "4"});
  succeed({"ingest", path("p.gdfmap"), path("plane.ply")});
  succeed({"train", path("p.gdfmap")});
  const Json json = json_of(
      {"evaluate", path("p.gdfmap"), "--truth", "plane", "--size", "4", "--samples", "5000"});
  EXPECT_GT(json.at("num_fine"), 1000);
  EXPECT_LT(json.at("mae"), 0.015);
  EXPECT_NEAR(json.at("gradient_norm_mean").get<double>(), 1.0, 0.08);
}

TEST_F(Commands, SliceWritesAPictureAndAnArray) {
  const std::string map = trained_map();
  succeed({"slice", map, "--axis", "x", "--at", "0.1", "--out", path("s.png")});
  EXPECT_EQ(read_file(path("s.png")).substr(1, 3), "PNG");
  succeed({"slice", map, "--at", "0.3", "--resolution", "0.1", "--region", "-1,-1,-1,1,1,1",
           "--out", path("s.npy")});
  EXPECT_EQ(read_file(path("s.npy")).substr(1, 5), "NUMPY");
  EXPECT_TRUE(
      refuses(2, "slice", "s.jpg", gdfmap({"slice", map, "--at", "0", "--out", path("s.jpg")})));
  EXPECT_TRUE(
      refuses(2, "slice", "", gdfmap({"slice", map, "--at", "500", "--out", path("m.png")})));
  EXPECT_FALSE(std::filesystem::exists(path("m.png")));
  succeed({"slice", map, "--at", "-0.1", "--at", "0.3", "--arrows", "--out", path("many.png")});
  EXPECT_EQ(read_file(path("many_z-0.1.png")).substr(1, 3), "PNG");
  EXPECT_EQ(read_file(path("many_z0.3.png")).substr(1, 3), "PNG");
}

TEST_F(Commands, BuildDoesTheAncestorsJobAndThenFindsNothingToDo) {
  write_cloud(path("scan.ply"), first_scan());
  write_text(path("config.yaml"), "io:\n  input_file: " + path("scan.ply") +
                                      "\n  output_base: " + path("out") +
                                      "\n  export_csv: true\n  export_bin: true\n"
                                      "processing:\n  num_threads: 2\n  cube_size: 1.0\n"
                                      "trainer:\n  edt_mode: pure\n"
                                      "solver:\n  max_time_seconds: 0.3\n"
                                      "edt:\n  margin_pure: 0.25\n");
  const Result first = gdfmap({"build", "-c", path("config.yaml")});
  EXPECT_TRUE(exits_with(0, first));
  for (const char* key : {"warning: solver.max_time_seconds", "warning: edt.margin_pure"}) {
    EXPECT_NE(first.err.find(key), std::string::npos) << first.err;
  }
  const std::string bin = read_file(path("out.bin"));
  const std::string csv = read_file(path("out.csv"));
  EXPECT_EQ(bin.substr(0, 4), "GDF1");
  EXPECT_EQ(csv.substr(0, 6), "CubeX,");
  const Json again = json_of({"build", "-c", path("config.yaml"), "--quiet"});
  EXPECT_EQ(again.at("train").at("num_tiles_trained"), 0);
  EXPECT_EQ(read_file(path("out.bin")), bin);
  EXPECT_EQ(read_file(path("out.csv")), csv);
}

TEST_F(Commands, SynthListsItsScenesAndWritesThem) {
  const Json scenes = json_of({"synth", "--list"}).at("scenes");
  EXPECT_GE(scenes.size(), 4u);
  for (const Json& scene : scenes) {
    const std::string cloud = path(scene.at("name").get<std::string>() + ".ply");
    succeed(
        {"synth", scene.at("name"), cloud, "--points", "100", "--noise", "0.01", "--seed", "3"});
    EXPECT_EQ(json_of({"info", cloud}).at("num_finite"), 100);
  }
}

}  // namespace
}  // namespace gdfmap::test
