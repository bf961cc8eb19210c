#include <filesystem>

#include <gtest/gtest.h>

#include <gdfmap/db/database.hpp>
#include <gdfmap/map/map.hpp>

#include "e2e/expect.hpp"
#include "e2e/map_bytes.hpp"
#include "e2e/scene.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap::test {
namespace {

constexpr int kUsage = 2;
constexpr int kIo = 3;
constexpr int kCorrupt = 4;

class Refusals : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }
  [[nodiscard]] bool exists(const std::string& name) const {
    return std::filesystem::exists(path(name));
  }
  /// Whether nothing but `names` is in the directory.
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path())) {
      names.push_back(entry.path().filename());
    }
    std::sort(names.begin(), names.end());
    return names;
  }
  std::string ingested_map() {
    write_xyz(path("scan.xyz"), first_scan());
    EXPECT_TRUE(exits_with(0, gdfmap({"ingest", path("a.gdfmap"), path("scan.xyz")})));
    return path("a.gdfmap");
  }

  TemporaryDirectory directory_;
};

TEST_F(Refusals, ACloudThatDoesNotExistIsNamedAndLeavesNoMap) {
  const Result result = gdfmap({"ingest", path("a.gdfmap"), path("missing.ply")});
  EXPECT_TRUE(refuses(kIo, "ingest", "missing.ply", result));
  EXPECT_EQ(files(), std::vector<std::string>{});
}

TEST_F(Refusals, OneMissingCloudAmongSeveralIsFoundBeforeAnyIsRead) {
  write_xyz(path("scan.xyz"), first_scan());
  const Result result = gdfmap({"ingest", path("a.gdfmap"), path("scan.xyz"), path("missing.ply")});
  EXPECT_TRUE(refuses(kIo, "ingest", "missing.ply", result));
  EXPECT_FALSE(exists("a.gdfmap"));
}

TEST_F(Refusals, AMapThatDoesNotExistIsNamed) {
  for (const char* subcommand : {"train", "verify", "tile", "info"}) {
    const Result result = gdfmap({subcommand, path("missing.gdfmap")});
    EXPECT_TRUE(refuses(kIo, subcommand, "missing.gdfmap", result));
  }
  EXPECT_TRUE(refuses(kIo, "query", "missing.gdfmap",
                      gdfmap({"query", path("missing.gdfmap"), "--at", "0,0,0"})));
  EXPECT_FALSE(exists("missing.gdfmap"));
}

TEST_F(Refusals, AFileOfNoKnownFormatIsCorrupt) {
  write_text(path("scan.ply"), std::string("\x7f"
                                           "ELF\x02\x01\x01\0\0\0\0",
                                           11));
  const Result result = gdfmap({"ingest", path("a.gdfmap"), path("scan.ply")});
  EXPECT_TRUE(refuses(kCorrupt, "ingest", "scan.ply", result));
  EXPECT_FALSE(exists("a.gdfmap"));
}

TEST_F(Refusals, AModelWithoutItsMagicIsCorrupt) {
  write_text(path("model.bin"), std::string(200, 'x'));
  EXPECT_TRUE(refuses(kCorrupt, "query", "model.bin",
                      gdfmap({"query", path("model.bin"), "--at", "0,0,0"})));
  EXPECT_TRUE(refuses(kCorrupt, "import", "model.bin",
                      gdfmap({"import", path("a.gdfmap"), path("model.bin")})));
  EXPECT_FALSE(exists("a.gdfmap"));
}

TEST_F(Refusals, ATruncatedCloudSaysWhereItEndsAndLeavesNoMap) {
  write_cloud(path("scan.ply"), first_scan());
  std::filesystem::resize_file(path("scan.ply"), std::filesystem::file_size(path("scan.ply")) / 2);
  const Result result = gdfmap({"ingest", path("a.gdfmap"), path("scan.ply")});
  EXPECT_TRUE(refuses(kCorrupt, "ingest", "scan.ply", result));
  EXPECT_EQ(files(), std::vector<std::string>{"scan.ply"});
}

TEST_F(Refusals, ATruncatedTextCloudLeavesAMapAsItWas) {
  const std::string map = ingested_map();
  write_text(path("bad.ply"),
             "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
             "property float z\nend_header\n0 0 0\n1 1 1\n");
  const Result result = gdfmap({"ingest", map, path("bad.ply")});
  EXPECT_TRUE(refuses(kCorrupt, "ingest", "bad.ply", result));
  EXPECT_EQ(Map::open(map, Access::kRead).points().sources().size(), 1u);
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", map})));
}

TEST_F(Refusals, AHeaderThatLiesAboutItsCountIsRefusedBeforeAnythingIsAllocated) {
  write_text(path("scan.ply"),
             "ply\nformat binary_little_endian 1.0\nelement vertex 900000000000\n"
             "property float x\nproperty float y\nproperty float z\nend_header\nabc");
  const Result result = gdfmap({"ingest", path("a.gdfmap"), path("scan.ply")});
  EXPECT_TRUE(refuses(kCorrupt, "ingest", "900000000000", result));
  EXPECT_FALSE(exists("a.gdfmap"));
}

TEST_F(Refusals, QueryBeforeTrainSaysWhatToRun) {
  const std::string map = ingested_map();
  EXPECT_TRUE(refuses(kUsage, "query", "gdfmap train", gdfmap({"query", map, "--at", "0,0,0"})));
  EXPECT_TRUE(refuses(kUsage, "export", "gdfmap train", gdfmap({"export", map, path("out.bin")})));
  EXPECT_TRUE(refuses(kUsage, "slice", "gdfmap train",
                      gdfmap({"slice", map, "--at", "0.2", "--out", path("out.png")})));
  EXPECT_FALSE(exists("out.bin"));
  EXPECT_FALSE(exists("out.png"));
}

TEST_F(Refusals, AMapOfAnotherVersionIsIncompatible) {
  const std::string map = ingested_map();
  for (const char* file : {"points.db", "cubes.db"}) {
    const std::filesystem::path database = std::filesystem::path(map) / file;
    const std::filesystem::path copy = path("copy");
    std::filesystem::copy_file(database, copy);
    db::Database(database, db::OpenMode::kWrite).execute("PRAGMA user_version = 2000000000");
    for (const char* subcommand : {"train", "verify", "info"}) {
      EXPECT_TRUE(refuses(kCorrupt, subcommand, file, gdfmap({subcommand, map})));
    }
    std::filesystem::rename(copy, database);
  }
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", map})));
}

TEST_F(Refusals, DatabasesOfTwoMapsDoNotMix) {
  const std::string map = ingested_map();
  EXPECT_TRUE(exits_with(0, gdfmap({"ingest", path("b.gdfmap"), path("scan.xyz")})));
  std::filesystem::copy_file(path("b.gdfmap/cubes.db"), path("a.gdfmap/cubes.db"),
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_TRUE(refuses(kCorrupt, "train", "different maps", gdfmap({"train", map})));
}

TEST_F(Refusals, AnUnknownKeyIsNamedWithTheNearestOne) {
  write_text(path("config.yaml"), "io:\n  input_file: a.ply\n  output_bass: out\n");
  EXPECT_TRUE(refuses(kUsage, "build", "did you mean io.output_base",
                      gdfmap({"build", "-c", path("config.yaml")})));
  EXPECT_EQ(files(), std::vector<std::string>{"config.yaml"});
}

TEST_F(Refusals, AnUnknownOptionIsNamedWithAHint) {
  const Result result = gdfmap({"train", path("a.gdfmap"), "--fast"});
  EXPECT_TRUE(refuses(kUsage, "train", "--fast", result));
  EXPECT_NE(result.err.find("gdfmap train --help"), std::string::npos);
}

TEST_F(Refusals, AnUnknownSubcommandIsNamed) {
  const Result result = gdfmap({"frobnicate"});
  EXPECT_TRUE(exits_with(kUsage, result));
  EXPECT_NE(result.err.find("frobnicate"), std::string::npos) << result.err;
}

TEST_F(Refusals, ValuesOutOfRangeAreUsageErrors) {
  const std::string map = ingested_map();
  const std::vector<std::vector<std::string>> commands = {
      {"train", map, "--memory", "63M"},
      {"train", map, "--memory", "lots"},
      {"train", map, "--threads", "-1"},
      {"query", map, "--at", "0,0"},
      {"query", map, "--at", "0,0,nan"},
      {"query", map},
      {"query", map, "--at", "0,0,0", "--format", "xml"},
      {"export", map, path("out.bin"), "--region", "1,1,1,0,0,0"},
      {"tile", map, "--key", "9,0,0,0"},
      {"ingest", path("b.gdfmap"), path("scan.xyz"), "--cube-size", "0"},
      {"ingest", path("b.gdfmap"), path("scan.xyz"), "--scale", "-1"},
      {"ingest", map, path("scan.xyz"), "--cube-size", "2"},
      {"synth", "room", path("out.ply")},
      {"synth", "atlantis", path("out.ply"), "--points", "10"},
  };
  for (const auto& command : commands) {
    const Result result = gdfmap(command);
    EXPECT_TRUE(refuses(kUsage, command.front(), "", result)) << ::testing::PrintToString(command);
  }
  EXPECT_FALSE(exists("b.gdfmap"));
  EXPECT_FALSE(exists("out.bin"));
  EXPECT_FALSE(exists("out.ply"));
}

TEST_F(Refusals, CubeSizeOfOptionAndConfigurationMustAgree) {
  write_xyz(path("scan.xyz"), first_scan());
  write_text(path("config.yaml"), "processing:\n  cube_size: 2\n");
  const std::vector<std::string> command = {"ingest", path("a.gdfmap"), path("scan.xyz"),
                                            "--config", path("config.yaml")};
  std::vector<std::string> contradicting = command;
  contradicting.insert(contradicting.end(), {"--cube-size", "1"});
  EXPECT_TRUE(refuses(kUsage, "ingest", "contradicts", gdfmap(contradicting)));
  EXPECT_TRUE(exits_with(0, gdfmap(command)));
  EXPECT_EQ(Map::open(path("a.gdfmap"), Access::kRead).geometry().cube_size, 2.0);
}

TEST_F(Refusals, AnotherConfigurationNeedsRetrain) {
  const std::string map = ingested_map();
  ASSERT_TRUE(exits_with(0, gdfmap({"train", map})));
  write_text(path("config.yaml"), "adaptive:\n  populated_steps: [4]\n  empty_steps: [4]\n");
  EXPECT_TRUE(refuses(kUsage, "train", "populated_steps",
                      gdfmap({"train", map, "--config", path("config.yaml")})));
  const std::string before = content_digest_of(map);
  EXPECT_TRUE(exits_with(0, gdfmap({"train", map, "--config", path("config.yaml"), "--retrain"})));
  EXPECT_NE(content_digest_of(map), before);
  EXPECT_TRUE(exits_with(0, gdfmap({"train", map, "--config", path("config.yaml")})));
}

TEST_F(Refusals, AnImportedMapCanNeitherBeTrainedNorIngestedInto) {
  const std::string map = ingested_map();
  ASSERT_TRUE(exits_with(0, gdfmap({"train", map})));
  ASSERT_TRUE(exits_with(0, gdfmap({"export", map, path("out.bin")})));
  ASSERT_TRUE(exits_with(0, gdfmap({"import", path("b.gdfmap"), path("out.bin")})));
  EXPECT_TRUE(refuses(kUsage, "train", "imported", gdfmap({"train", path("b.gdfmap")})));
  EXPECT_TRUE(refuses(kUsage, "ingest", "imported",
                      gdfmap({"ingest", path("b.gdfmap"), path("scan.xyz")})));
  EXPECT_TRUE(refuses(kUsage, "import", "already is a map",
                      gdfmap({"import", path("b.gdfmap"), path("out.bin")})));
}

TEST_F(Refusals, ASecondWriterIsToldWhoIsWriting) {
  const std::string map = ingested_map();
  const Map writer = Map::open(map, Access::kWrite);
  const std::string holder = "process " + std::to_string(::getpid());
  for (const auto& command :
       std::vector<std::vector<std::string>>{{"train", map}, {"ingest", map, path("scan.xyz")}}) {
    const Result result = gdfmap(command);
    EXPECT_TRUE(refuses(kIo, command.front(), "busy", result));
    EXPECT_NE(result.err.find(holder), std::string::npos) << result.err;
  }
  EXPECT_TRUE(exits_with(0, gdfmap({"info", map})));  // readers are free
}

TEST_F(Refusals, DamagedCubesAreFoundByVerifyAndAnsweredUnknown) {
  const std::string map = ingested_map();
  ASSERT_TRUE(exits_with(0, gdfmap({"train", map})));
  db::Database(std::filesystem::path(map) / "cubes.db", db::OpenMode::kWrite)
      .execute("UPDATE tile_blobs SET data = zeroblob(length(data))");
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", map, "--quick"})));
  const Result verified = gdfmap({"verify", map});
  EXPECT_TRUE(refuses(kCorrupt, "verify", "fault", verified));
  EXPECT_NE(verified.out.find("fault: "), std::string::npos);
  const Result queried = gdfmap({"query", map, "--at", "0.1,0.1,0.3"});
  EXPECT_TRUE(refuses(kCorrupt, "query", "could not be read", queried));
  EXPECT_NE(queried.out.find("nan,nan,nan,nan,unknown,nan"), std::string::npos) << queried.out;
}

}  // namespace
}  // namespace gdfmap::test
