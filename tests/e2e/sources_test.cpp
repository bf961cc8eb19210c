// Clouds that come, go, are replaced and compacted: the field depends on those that are left alone.

#include <csignal>
#include <filesystem>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <gdfmap/io/point_writer.hpp>

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

std::vector<Vector3> joined(std::vector<Vector3> a, const std::vector<Vector3>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

class Sources : public ::testing::Test {
 protected:
  Sources() {
    write_xyz(path("a.xyz"), first_scan());
    write_xyz(path("b.xyz"), second_scan());
    write_xyz(path("c.xyz"), square(-0.6, 0.4, 0.5, 1.2, 1200));
    write_xyz(path("ab.xyz"), joined(first_scan(), second_scan()));
  }
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }

  void ingest(const std::string& map, const std::vector<std::string>& clouds,
              const std::vector<std::string>& options = {}) {
    std::vector<std::string> command = {"ingest", path(map)};
    for (const std::string& cloud : clouds) command.push_back(path(cloud));
    command.insert(command.end(), options.begin(), options.end());
    EXPECT_TRUE(exits_with(0, gdfmap(command)));
  }
  void train(const std::string& map) { run({"train", path(map)}); }
  static void run(const std::vector<std::string>& command) {
    EXPECT_TRUE(exits_with(0, gdfmap(command)));
  }
  [[nodiscard]] Json sources(const std::string& map) const {
    const Result result = gdfmap({"sources", path(map), "--json"});
    EXPECT_TRUE(exits_with(0, result));
    return Json::parse(result.out).at("sources");
  }
  /// These clouds at once, trained once.
  MapBytes field_of(const std::vector<std::string>& clouds,
                    const std::vector<std::string>& options = {}) {
    const std::string map = "reference" + std::to_string(num_references_++) + ".gdfmap";
    ingest(map, clouds, options);
    train(map);
    return bytes_of(path(map));
  }
  [[nodiscard]] MapBytes bytes(const std::string& map) const { return bytes_of(path(map)); }

  TemporaryDirectory directory_;
  int num_references_ = 0;
};

TEST_F(Sources, ARemovedCloudIsAsIfNeverIngested) {
  const MapBytes expected = field_of({"a.xyz", "b.xyz"});
  ingest("m.gdfmap", {"a.xyz", "b.xyz", "c.xyz"});
  train("m.gdfmap");
  EXPECT_NE(bytes("m.gdfmap"), expected);
  run({"remove", path("m.gdfmap"), "--source", "3"});
  train("m.gdfmap");
  EXPECT_EQ(bytes("m.gdfmap"), expected);
  run({"verify", path("m.gdfmap")});
}

TEST_F(Sources, RemovingBeforeTrainingAndByPathIsTheSame) {
  const MapBytes expected = field_of({"a.xyz"});
  ingest("m.gdfmap", {"c.xyz", "a.xyz"});
  run({"remove", path("m.gdfmap"), "--source", path("c.xyz")});
  train("m.gdfmap");
  EXPECT_EQ(bytes("m.gdfmap"), expected);
}

TEST_F(Sources, ACloudTwiceOrFilesOfBothAreTheSameField) {
  const MapBytes expected = field_of({"a.xyz", "b.xyz"});
  ingest("m.gdfmap", {"a.xyz", "b.xyz", "a.xyz"});
  train("m.gdfmap");
  EXPECT_EQ(sources("m.gdfmap").size(), 2u);
  EXPECT_EQ(bytes("m.gdfmap"), expected);
  EXPECT_EQ(field_of({"ab.xyz"}), expected);
  // Twice under other options: the same points again.
  ingest("twice.gdfmap", {"a.xyz", "b.xyz"});
  ingest("twice.gdfmap", {"a.xyz"}, {"--drop-zero"});
  EXPECT_EQ(sources("twice.gdfmap").size(), 3u);
  train("twice.gdfmap");
  EXPECT_EQ(bytes("twice.gdfmap"), expected);
}

TEST_F(Sources, AReplacedCloudIsAsIfOnlyTheNewOneHadCome) {
  const MapBytes expected = field_of({"b.xyz", "c.xyz"});
  ingest("m.gdfmap", {"a.xyz", "c.xyz"});
  train("m.gdfmap");
  ingest("m.gdfmap", {"b.xyz"}, {"--replace", "1"});
  train("m.gdfmap");
  EXPECT_EQ(bytes("m.gdfmap"), expected);
  const Json list = sources("m.gdfmap");
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0].at("id"), 2);
  EXPECT_EQ(list[1].at("path"), path("b.xyz"));
}

TEST_F(Sources, AReplacementKilledBeforeItsCommitLeavesTheOldCloud) {
  const MapBytes old_field = field_of({"a.xyz"}), new_field = field_of({"b.xyz"});
  const std::vector<std::string> replace = {"ingest", path("m.gdfmap"), path("b.xyz"), "--replace",
                                            "1"};
  for (const char* failpoint : {"ingest.before_append:1", "ingest.before_publish:1",
                                "ingest.after_publish:1", "discard.before_commit:1"}) {
    SCOPED_TRACE(failpoint);
    std::filesystem::remove_all(path("m.gdfmap"));
    ingest("m.gdfmap", {"a.xyz"});
    ASSERT_EQ(gdfmap_until(failpoint, replace).signal, SIGKILL);
    const bool published = std::string(failpoint).find("before_append") == std::string::npos &&
                           std::string(failpoint).find("before_publish") == std::string::npos;
    train("m.gdfmap");
    EXPECT_EQ(bytes("m.gdfmap"), published ? new_field : old_field);
    EXPECT_TRUE(exits_with(0, gdfmap(replace)));
    train("m.gdfmap");
    EXPECT_EQ(bytes("m.gdfmap"), new_field);
    run({"verify", path("m.gdfmap")});
  }
}

TEST_F(Sources, RemoveKilledAroundItsCommitsAndRunOnIsExact) {
  const MapBytes expected = field_of({"a.xyz"});
  for (const char* failpoint : {"remove.before_commit:1", "remove.after_commit:1",
                                "discard.before_commit:1", "discard.after_commit:1"}) {
    SCOPED_TRACE(failpoint);
    std::filesystem::remove_all(path("m.gdfmap"));
    ingest("m.gdfmap", {"a.xyz", "b.xyz"});
    const std::vector<std::string> remove = {"remove", path("m.gdfmap"), "--source", "2"};
    ASSERT_EQ(gdfmap_until(failpoint, remove).signal, SIGKILL);
    if (sources("m.gdfmap").size() == 2) run(remove);
    train("m.gdfmap");
    EXPECT_EQ(bytes("m.gdfmap"), expected);
    run({"verify", path("m.gdfmap")});
  }
}

TEST_F(Sources, CompactChangesNoFieldAndTrainFindsNothingToDo) {
  ingest("m.gdfmap", {"a.xyz", "b.xyz"});
  train("m.gdfmap");
  const MapBytes expected = bytes("m.gdfmap");
  for (const char* failpoint : {"compact.before_commit:1", "compact.after_commit:1"}) {
    EXPECT_EQ(gdfmap_until(failpoint, {"compact", path("m.gdfmap")}).signal, SIGKILL);
  }
  run({"compact", path("m.gdfmap")});
  run({"verify", path("m.gdfmap")});
  const Result again = gdfmap({"train", path("m.gdfmap"), "--json"});
  EXPECT_EQ(Json::parse(again.out).at("num_tiles_trained"), 0) << again.out;
  EXPECT_EQ(bytes("m.gdfmap"), expected);
}

TEST_F(Sources, VoxelsInOneGoAreTheSameFieldAsInTwoAndAfterRemoval) {
  const MapBytes expected = field_of({"ab.xyz"}, {"--voxel", "0.11"});
  EXPECT_NE(expected, field_of({"ab.xyz"}));
  EXPECT_EQ(field_of({"a.xyz", "b.xyz"}, {"--voxel", "0.11"}), expected);
  ingest("m.gdfmap", {"b.xyz"}, {"--voxel", "0.11"});
  train("m.gdfmap");
  ingest("m.gdfmap", {"c.xyz", "a.xyz"}, {"--voxel", "0.11"});
  train("m.gdfmap");
  run({"remove", path("m.gdfmap"), "--source", "2"});
  run({"compact", path("m.gdfmap")});
  train("m.gdfmap");
  EXPECT_EQ(bytes("m.gdfmap"), expected);
}

TEST_F(Sources, RegionsThatPartitionACloudAreTheSameFieldAsTheWhole) {
  const MapBytes expected = field_of({"ab.xyz"});
  ingest("m.gdfmap", {"ab.xyz"}, {"--region=-9,-9,-9,0.25,9,9"});
  const Json first = sources("m.gdfmap")[0];
  EXPECT_GT(first.at("num_rejected").at("outside"), 0);
  ingest("m.gdfmap", {"ab.xyz"}, {"--region=0.25,-9,-9,9,9,9"});
  const Json list = sources("m.gdfmap");
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0].at("num_rejected").at("outside"),
            list[1].at("num_stored").get<int>() + list[1].at("num_duplicates").get<int>());
  train("m.gdfmap");
  EXPECT_EQ(bytes("m.gdfmap"), expected);
}

TEST_F(Sources, PlyPcdLasAndXyzOfTheSameQuantisedPointsAreTheSameField) {
  std::vector<Vector3> points = joined(first_scan(), second_scan());
  for (Vector3& p : points) p = (p * 1024.0).array().round() / 1024.0;  // exact in all of them
  MapBytes expected;
  for (const char* name : {"cloud.ply", "cloud.pcd", "cloud.las", "cloud.xyz", "cloud.csv"}) {
    WriterOptions options;
    options.las_scale = 1.0 / 1024.0;
    const auto writer = create_point_cloud(path(name), options);
    writer->write(points);
    writer->finish();
    const MapBytes field = field_of({name});
    if (expected.bin.empty()) expected = field;
    EXPECT_EQ(field, expected) << name;
  }
}

TEST_F(Sources, ListsEveryCloudWithItsOptionsAndCounts) {
  ingest("m.gdfmap", {"a.xyz"});
  ingest("m.gdfmap", {"b.xyz"}, {"--voxel", "0.25", "--region=0,0,0,1,1,1"});
  const Json list = sources("m.gdfmap");
  ASSERT_EQ(list.size(), 2u);
  const Json& second = list[1];
  EXPECT_EQ(second.at("id"), 2);
  EXPECT_NE(second.at("parameters").get<std::string>().find("region=0,0,0,1,1,1 voxel=0.25"),
            std::string::npos);
  EXPECT_GT(second.at("num_thinned"), 0);
  EXPECT_EQ(second.at("num_read"), second_scan().size());
  const Result text = gdfmap({"sources", path("m.gdfmap")});
  EXPECT_NE(text.out.find("2: " + path("b.xyz")), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("outside the region"), std::string::npos) << text.out;
}

TEST_F(Sources, UnknownAndAmbiguousSourcesAreRefusedWithWhatThereIs) {
  ingest("m.gdfmap", {"a.xyz"});
  ingest("m.gdfmap", {"a.xyz"}, {"--voxel", "0.25"});
  const auto remove = [&](const std::string& source) {
    return gdfmap({"remove", path("m.gdfmap"), "--source", source});
  };
  EXPECT_TRUE(refuses(kUsage, "remove", "no source 3; the map has 1 (", remove("3")));
  EXPECT_TRUE(refuses(kUsage, "remove", "no source nowhere.ply", remove("nowhere.ply")));
  EXPECT_TRUE(refuses(kUsage, "remove", "by its id, 1 (", remove(path("a.xyz"))));
  EXPECT_TRUE(refuses(kUsage, "ingest", "no source 9 to replace",
                      gdfmap({"ingest", path("m.gdfmap"), path("b.xyz"), "--replace", "9"})));
  EXPECT_TRUE(refuses(
      kUsage, "ingest", "--replace",
      gdfmap({"ingest", path("m.gdfmap"), path("b.xyz"), path("c.xyz"), "--replace", "1"})));
  EXPECT_TRUE(refuses(kUsage, "ingest", "voxel",
                      gdfmap({"ingest", path("m.gdfmap"), path("b.xyz"), "--voxel", "1.5"})));
  EXPECT_EQ(sources("m.gdfmap").size(), 2u);
}

TEST_F(Sources, RemoveAndCompactWaitForNobody) {
  ingest("m.gdfmap", {"a.xyz"});
  const Map writer = Map::open(path("m.gdfmap"), Access::kWrite);
  EXPECT_TRUE(
      refuses(kIo, "remove", "busy", gdfmap({"remove", path("m.gdfmap"), "--source", "1"})));
  EXPECT_TRUE(refuses(kIo, "compact", "busy", gdfmap({"compact", path("m.gdfmap")})));
  EXPECT_EQ(sources("m.gdfmap").size(), 1u);  // readers are free
}

}  // namespace
}  // namespace gdfmap::test
