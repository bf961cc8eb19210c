#include <cstring>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "e2e/expect.hpp"
#include "e2e/scene.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap::test {
namespace {

using Json = nlohmann::json;

constexpr const char* kHeader = "x,y,z,distance,gx,gy,gz,status,expected_error\n";

class Pipes : public ::testing::Test {
 protected:
  Pipes() {
    write_xyz(path("scan.xyz"), first_scan());
    EXPECT_TRUE(exits_with(0, gdfmap({"ingest", map_, path("scan.xyz")})));
    EXPECT_TRUE(exits_with(0, gdfmap({"train", map_})));
  }
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }

  TemporaryDirectory directory_;
  std::string map_ = path("a.gdfmap");
};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST_F(Pipes, AReaderThatLeavesEndsQueryQuietly) {
  write_xyz(path("many.xyz"), square(0.0, 0.0, 0.4, 1.0, 200'000));
  Launch launch;
  launch.program = GDFMAP_PROGRAM;
  launch.read_at_most = 1;
  for (const char* format : {"csv", "json", "npy"}) {
    launch.arguments = {"query", map_, "--points", path("many.xyz"), "--format", format};
    const Result result = run(launch);
    EXPECT_TRUE(exits_with(0, result)) << format;
    EXPECT_EQ(result.err, "") << format;
  }
}

TEST_F(Pipes, AFullStandardOutputIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  Launch launch;
  launch.program = "/bin/sh";
  launch.arguments = {"-c",
                      std::string(GDFMAP_PROGRAM) + " query " + map_ + " --at 0,0,0 >/dev/full"};
  EXPECT_TRUE(refuses(3, "query", "standard output", run(launch)));
}

TEST_F(Pipes, QueryReadsPointsFromStandardInputWithAndWithoutAHeader) {
  const Result at = gdfmap({"query", map_, "--at", "0.1,0.2,0.3", "--at", "-0.25,0,0.5"});
  EXPECT_TRUE(exits_with(0, at));
  EXPECT_EQ(at.out.find(kHeader), 0u);
  EXPECT_EQ(lines_of(at.out).size(), 3u);
  for (const char* text : {"0.1,0.2,0.3\n-0.25,0,0.5\n", "x,y,z\n0.1,0.2,0.3\n-0.25,0,0.5\n",
                           "0.1 0.2 0.3\n-0.25 0 0.5"}) {
    const Result piped = gdfmap({"query", map_, "--points", "-"}, text);
    EXPECT_TRUE(exits_with(0, piped));
    EXPECT_EQ(piped.out, at.out) << text;
  }
}

TEST_F(Pipes, ABadLineOfPointsIsNamed) {
  write_text(path("points.csv"), "x,y,z\n0,0,0\n0,zero,0\n");
  const Result result = gdfmap({"query", map_, "--points", path("points.csv")});
  EXPECT_TRUE(refuses(4, "query", "points.csv", result));
  EXPECT_NE(result.err.find("3"), std::string::npos) << result.err;  // the line
}

TEST_F(Pipes, PointsThatAreNotFiniteAreAnsweredUnknown) {
  write_cloud(path("points.ply"), std::vector<Vector3>{{0, 0, 0}, {NAN, 0, 0}, {0, 1e300, 0}});
  const Result result = gdfmap({"query", map_, "--points", path("points.ply")});
  EXPECT_TRUE(exits_with(0, result));
  const std::vector<std::string> lines = lines_of(result.out);
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_NE(lines[1].find(",fine,"), std::string::npos) << lines[1];
  EXPECT_EQ(lines[2], "nan,0,0,nan,nan,nan,nan,unknown,nan");
  EXPECT_EQ(lines[3], "0,1e+300,0,nan,nan,nan,nan,unknown,nan");
}

TEST_F(Pipes, TheThreeFormatsSayTheSame) {
  const std::vector<std::string> command = {"query",       map_,   "--at",
                                            "0.1,0.2,0.3", "--at", "nan-free,0,0"};
  EXPECT_TRUE(refuses(2, "query", "nan-free", gdfmap(command)));
  const auto answers = [&](const char* format) {
    const Result result =
        gdfmap({"query", map_, "--at", "0.1,0.2,0.3", "--at", "1e12,0,0", "--format", format});
    EXPECT_TRUE(exits_with(0, result));
    return result.out;
  };
  const std::vector<std::string> csv = lines_of(answers("csv"));
  const Json json = Json::parse(answers("json"));
  const std::string npy = answers("npy");
  ASSERT_EQ(csv.size(), 3u);
  ASSERT_EQ(json.size(), 2u);

  EXPECT_EQ(npy.substr(1, 5), "NUMPY");
  EXPECT_NE(npy.find("'<f8'"), std::string::npos);
  EXPECT_NE(npy.find("(2,9,)"), std::string::npos);
  std::array<double, 18> rows{};
  ASSERT_GT(npy.size(), sizeof(rows));
  std::memcpy(rows.data(), npy.data() + npy.size() - sizeof(rows), sizeof(rows));

  const double distance = json[0].at("distance");
  EXPECT_NEAR(rows[3], distance, 1e-8);
  EXPECT_NEAR(std::stod(csv[1].substr(std::string("0.1,0.2,0.3,").size())), distance, 1e-8);
  EXPECT_EQ(json[0].at("status"), "fine");
  EXPECT_EQ(rows[7], 0.0);
  EXPECT_EQ(json[1].at("status"), "unknown");  // beyond the lattice
  EXPECT_TRUE(json[1].at("distance").is_null());
  EXPECT_EQ(rows[16], 3.0);
}

TEST_F(Pipes, NoPointsAreAHeaderAlone) {
  write_cloud(path("none.ply"), {});
  const std::vector<std::string> command = {"query", map_, "--points", path("none.ply"),
                                            "--format"};
  const auto answers = [&](const char* format) {
    std::vector<std::string> arguments = command;
    arguments.emplace_back(format);
    const Result result = gdfmap(arguments);
    EXPECT_TRUE(exits_with(0, result));
    return result.out;
  };
  EXPECT_EQ(answers("csv"), kHeader);
  EXPECT_EQ(Json::parse(answers("json")), Json::array());
  EXPECT_NE(answers("npy").find("(0,9,)"), std::string::npos);
}

TEST_F(Pipes, IngestReadsStandardInputAsItReadsTheFile) {
  const Result piped =
      gdfmap({"ingest", path("b.gdfmap"), "-", "--json"}, read_file(path("scan.xyz")));
  EXPECT_TRUE(exits_with(0, piped));
  EXPECT_EQ(Json::parse(piped.out).at("num_read"), first_scan().size());
  const Result again = gdfmap({"ingest", path("b.gdfmap"), path("scan.xyz"), "--json"});
  EXPECT_TRUE(Json::parse(again.out).at("sources")[0].at("already_present"));
}

TEST_F(Pipes, ProgressAsJsonIsOneObjectALine) {
  const Result result = gdfmap({"ingest", path("b.gdfmap"), path("scan.xyz"), "--progress=json"});
  EXPECT_TRUE(exits_with(0, result));
  const std::vector<std::string> lines = lines_of(result.err);
  ASSERT_FALSE(lines.empty());
  for (const std::string& line : lines) {
    const Json progress = Json::parse(line);
    EXPECT_EQ(progress.at("stage"), "points");
    EXPECT_GT(progress.at("resident_bytes"), 1000);
    EXPECT_EQ(progress.at("done"), first_scan().size());
  }
}

TEST_F(Pipes, NothingButErrorsGoesToStandardErrorWhereNobodyLooks) {
  for (const auto& command : std::vector<std::vector<std::string>>{
           {"ingest", path("b.gdfmap"), path("scan.xyz")}, {"train", path("b.gdfmap")}}) {
    const Result result = gdfmap(command);  // not a terminal, and done before ten seconds are over
    EXPECT_TRUE(exits_with(0, result));
    EXPECT_EQ(result.err, "");
  }
}

}  // namespace
}  // namespace gdfmap::test
