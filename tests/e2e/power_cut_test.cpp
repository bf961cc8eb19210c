#include <filesystem>
#include <thread>

#include <gtest/gtest.h>

#include <gdfmap/db/database.hpp>

#include "e2e/expect.hpp"
#include "e2e/map_bytes.hpp"
#include "e2e/scene.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap::test {
namespace {

namespace fs = std::filesystem;

/// A map whose two databases are not of the same moment, was copied, or lost what it was made from.
class PowerCut : public ::testing::Test {
 protected:
  PowerCut() {
    write_xyz(path("a.xyz"), first_scan());
    write_xyz(path("b.xyz"), second_scan());
  }
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }
  void ingest(const std::string& map, const std::string& cloud) {
    EXPECT_TRUE(exits_with(0, gdfmap({"ingest", path(map), path(cloud)})));
  }
  void train(const std::string& map) { EXPECT_TRUE(exits_with(0, gdfmap({"train", path(map)}))); }
  void copy(const std::string& from, const std::string& to) {
    fs::copy(path(from), path(to),
             fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  }
  /// One cloud trained, kept as "old.gdfmap"; then the other one too, in "m.gdfmap".
  MapBytes map_and_its_past() {
    ingest("m.gdfmap", "a.xyz");
    train("m.gdfmap");
    copy("m.gdfmap", "old.gdfmap");
    ingest("m.gdfmap", "b.xyz");
    train("m.gdfmap");
    return bytes_of(path("m.gdfmap"));
  }

  TemporaryDirectory directory_;
};

TEST_F(PowerCut, CubesOfAnEarlierMomentAreCaughtUp) {
  const MapBytes expected = map_and_its_past();
  copy("old.gdfmap/cubes.db", "m.gdfmap/cubes.db");
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", path("m.gdfmap")})));
  train("m.gdfmap");
  EXPECT_EQ(bytes_of(path("m.gdfmap")), expected);
}

TEST_F(PowerCut, PointsOfAnEarlierMomentTakeTheCubesBackWithThem) {
  const MapBytes latest = map_and_its_past();
  const MapBytes expected = bytes_of(path("old.gdfmap"));
  ASSERT_NE(latest, expected);
  copy("old.gdfmap/points.db", "m.gdfmap/points.db");
  train("m.gdfmap");
  EXPECT_EQ(bytes_of(path("m.gdfmap")), expected);
  ingest("m.gdfmap", "b.xyz");  // the lost scan comes again
  train("m.gdfmap");
  EXPECT_EQ(bytes_of(path("m.gdfmap")), latest);
}

TEST_F(PowerCut, CubesOfBeforeTheFirstTrainingAreCaughtUp) {
  ingest("m.gdfmap", "a.xyz");
  copy("m.gdfmap", "old.gdfmap");
  train("m.gdfmap");
  const MapBytes expected = bytes_of(path("m.gdfmap"));
  copy("old.gdfmap/cubes.db", "m.gdfmap/cubes.db");
  train("m.gdfmap");
  EXPECT_EQ(bytes_of(path("m.gdfmap")), expected);
  fs::remove(path("m.gdfmap/cubes.db"));
  train("m.gdfmap");
  EXPECT_EQ(bytes_of(path("m.gdfmap")), expected);
}

TEST_F(PowerCut, ACopiedMapIsTheSameMapAndGoesOn) {
  const MapBytes expected = map_and_its_past();
  copy("old.gdfmap", "copied.gdfmap");
  ingest("copied.gdfmap", "b.xyz");
  train("copied.gdfmap");
  EXPECT_EQ(bytes_of(path("copied.gdfmap")), expected);
  EXPECT_NE(content_digest_of(path("old.gdfmap")), expected.content_digest);
}

TEST_F(PowerCut, ASourceFileThatIsGoneIsNotMissed) {
  const MapBytes expected = map_and_its_past();
  fs::remove(path("a.xyz"));
  copy("old.gdfmap", "without.gdfmap");
  ingest("without.gdfmap", "b.xyz");
  train("without.gdfmap");
  EXPECT_EQ(bytes_of(path("without.gdfmap")), expected);
}

TEST_F(PowerCut, DamagedCubesAreFittedAgain) {
  const MapBytes expected = map_and_its_past();
  db::Database(path("m.gdfmap/cubes.db"), db::OpenMode::kWrite)
      .execute("UPDATE tile_blobs SET data = zeroblob(length(data))");
  EXPECT_TRUE(exits_with(4, gdfmap({"verify", path("m.gdfmap")})));
  const Result trained = gdfmap({"train", path("m.gdfmap")});
  EXPECT_TRUE(exits_with(0, trained));
  EXPECT_NE(trained.err.find("checksum does not match; it is fitted again"), std::string::npos)
      << trained.err;
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", path("m.gdfmap")})));
  EXPECT_EQ(bytes_of(path("m.gdfmap")), expected);
}

TEST_F(PowerCut, TwoTrainersAtOnceLoseNothing) {
  const MapBytes expected = map_and_its_past();
  copy("old.gdfmap", "two.gdfmap");
  ingest("two.gdfmap", "b.xyz");
  Result first, second;
  std::thread other([&] { first = gdfmap({"train", path("two.gdfmap")}); });
  second = gdfmap({"train", path("two.gdfmap")});
  other.join();
  // The one that found the other at work was refused; at least one did the work.
  EXPECT_TRUE(first.exit_code == 0 || second.exit_code == 0) << first.err << second.err;
  for (const Result& result : {first, second}) {
    if (result.exit_code == 0) continue;
    EXPECT_TRUE(refuses(3, "train", "busy", result));
  }
  EXPECT_EQ(bytes_of(path("two.gdfmap")), expected);
}

}  // namespace
}  // namespace gdfmap::test
