#include <atomic>
#include <filesystem>
#include <fstream>
#include <utility>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/db/database.hpp>
#include <gdfmap/pipeline/verify.hpp>
#include <gdfmap/train/train.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

TEST(Verify, ASoundMapHasNoFaults) {
  const test::TemporaryDirectory directory;
  Map map = test::map_of(directory / "a.gdfmap", {{{0.5, 0.5, 0.5}}});
  train(map);
  for (const bool quick : {true, false}) {
    const VerifyReport report = verify(map, quick);
    EXPECT_TRUE(report.sound()) << testing::PrintToString(report.cube_faults)
                                << testing::PrintToString(report.point_faults);
    EXPECT_EQ(report.content_digest, map.cubes().content_digest());
  }
}

/// Runs SQL on one of the databases of a map.
void tamper(const std::filesystem::path& database, const std::string& sql) {
  db::Database(database, db::OpenMode::kWrite).execute(sql);
}

TEST(Verify, NamesADamagedTileAndADamagedBlock) {
  const test::TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  {
    Map map = test::map_of(path, {{{0.5, 0.5, 0.5}}});
    train(map);
  }
  tamper(path / "cubes.db",
         "UPDATE tile_blobs SET data = zeroblob(length(data)) "
         "WHERE tile = (SELECT id FROM tiles WHERE x = 0 AND y = 0 AND z = 0)");
  tamper(path / "points.db", "UPDATE blocks SET data = zeroblob(length(data))");
  Map map = Map::open(path, Access::kRead);
  EXPECT_TRUE(verify(map, true).sound());  // only the bytes tell
  const VerifyReport report = verify(map, false);
  EXPECT_EQ(report.cube_faults,
            std::vector{(path / "cubes.db").string() + ": tile 0,0,0,0: checksum does not match"});
  EXPECT_EQ(report.point_faults,
            std::vector{(path / "points.db").string() + ": tile (0, 0, 0), block 1 of source 1 (" +
                        path.string() + ".ply) is damaged: its checksum does not match"});
}

TEST(Verify, GoesOnWithThePointsWhenTheCubesCannotBeReadAtAll) {
  const test::TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  {
    Map map = test::map_of(path, test::scene_points("box", 4000));
    train(map);
  }
  {
    // Everything behind the pages of the schema and of `meta`.
    std::fstream file(path / "cubes.db", std::ios::in | std::ios::out | std::ios::binary);
    const auto size = std::filesystem::file_size(path / "cubes.db");
    file.seekp(4 * db::kPageBytes);
    for (std::uintmax_t i = 4 * db::kPageBytes; i < size; ++i) file.put('Z');
  }
  tamper(path / "points.db", "UPDATE blocks SET data = zeroblob(length(data)) WHERE id = 1");
  Map map = Map::open(path, Access::kRead);
  const VerifyReport report = verify(map, false);
  EXPECT_FALSE(report.cube_faults.empty());
  EXPECT_EQ(report.point_faults.size(), 1u);
  EXPECT_FALSE(report.content_digest.has_value());
}

TEST(Verify, FaultsAreOneLineEach) {
  const test::TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  { Map map = test::map_of(path, test::scene_points("box", 4000)); }
  {
    std::fstream file(path / "points.db", std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(10 * db::kPageBytes - 2000);
    for (int i = 0; i < 4000; ++i) file.put('Z');
  }
  Map map = Map::open(path, Access::kRead);
  const VerifyReport report = verify(map, true);
  EXPECT_FALSE(report.point_faults.empty());
  for (const std::string& fault : report.point_faults) {
    EXPECT_EQ(fault.find('\n'), std::string::npos) << fault;
    EXPECT_TRUE(fault.starts_with((path / "points.db").string())) << fault;
  }
}

TEST(Verify, AWriterBesideItIsNoFault) {
  const test::TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  Map writer = test::map_of(path, test::scene_points("box", 4000));
  train(writer);
  Map reader = Map::open(path, Access::kRead);

  /// Changes the map in the middle of the check.
  class Writes : public ReportSink {
   public:
    explicit Writes(Map& map) : map_(map) {}
    void on_progress(const Progress&) override {
      if (std::exchange(done, true)) return;
      std::vector<TileKey> keys;
      map_.cubes().for_each_state([&](const TileState& state) { keys.push_back(state.key); });
      map_.cubes().erase(keys);
    }
    void on_message(Severity, const std::string&) override {}
    bool done = false;

   private:
    Map& map_;
  };
  Writes writes(writer);
  RunContext context;
  context.sink = &writes;
  const VerifyReport report = verify(reader, false, context);
  EXPECT_TRUE(writes.done);
  EXPECT_TRUE(report.sound()) << testing::PrintToString(report.cube_faults);
  EXPECT_EQ(reader.cubes().totals().num_tiles, 0);
}

TEST(Verify, StopsWhenAsked) {
  const test::TemporaryDirectory directory;
  Map map = test::map_of(directory / "a.gdfmap", {{{0.5, 0.5, 0.5}}});
  const std::atomic<bool> stop = true;
  RunContext context;
  context.stop = &stop;
  try {
    static_cast<void>(verify(map, true, context));
    FAIL() << "it went on";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInterrupted);
  }
  EXPECT_TRUE(verify(map, true).sound());  // no snapshot is left open
}

}  // namespace
}  // namespace gdfmap
