// Sources that are replaced, cut to a region, compacted.

#include <csignal>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gdfmap/core/failpoint.hpp>

#include "tiling_fixtures.hpp"

namespace gdfmap {
namespace {

using ChangeTest = TilingTest;

const std::vector<Vector3>& first_cloud() {
  static const std::vector<Vector3> points = wavy_surface(40'000, 1, 20.0);
  return points;
}
const std::vector<Vector3>& second_cloud() {
  static const std::vector<Vector3> points = wavy_surface(40'000, 2, 20.0);
  return points;
}

IngestOptions replacing(std::int64_t id) {
  IngestOptions options;
  options.replaced_source = id;
  return options;
}

/// Pairs of a tile and a source, each of which compacting leaves with one block here.
std::uint64_t num_parts(const std::filesystem::path& path) {
  return static_cast<std::uint64_t>(
      db::Database(path, db::OpenMode::kRead).query_int("SELECT count(*) FROM tile_sources"));
}

/// A store whose every tile has several small blocks, as little memory leaves them.
PointStore fragmented(const std::filesystem::path& path, int voxel_steps = 0) {
  PointStore store(path, db::OpenMode::kCreate);
  for (const int seed : {3, 4}) {
    const std::int64_t id = store.begin_source("part", "", voxel_steps);
    SourceRecord source;
    source.id = id;
    source.identity = {static_cast<std::uint64_t>(seed), 1};
    for (int part = 0; part < 5; ++part) {
      std::map<TileKey, std::vector<TileOffset>> tiles;
      for (const Vector3& p_world : wavy_surface(20'000, static_cast<std::uint32_t>(seed), 20.0)) {
        const LatticePoint p = *kLattice.quantize(p_world);
        const LatticePoint origin = tile_origin(tile_of(p));
        // Parts overlap: a point in two of them is a duplicate that only a merge can find.
        const std::int64_t turn = p.x & 7;
        if (turn < part || turn > part + 3) continue;
        tiles[tile_of(p)].push_back({static_cast<std::uint16_t>(p.x - origin.x),
                                     static_cast<std::uint16_t>(p.y - origin.y),
                                     static_cast<std::uint16_t>(p.z - origin.z)});
      }
      std::vector<NewBlock> blocks;
      for (auto& [key, points] : tiles) {
        NewBlock block;
        block.tile = key;
        block.digest = hash128(std::as_bytes(std::span(points)));
        sort_unique(points);
        for (const TileOffset& p : points) block.cubes.set(p.cube());
        block.num_points = static_cast<std::uint32_t>(points.size());
        block.data = encode_block(points);
        source.counts.num_read += points.size();
        blocks.push_back(std::move(block));
      }
      store.append(id, blocks);
    }
    source.counts.num_stored = source.counts.num_read;
    store.publish(source);
  }
  return store;
}

TEST_F(ChangeTest, AReplacedSourceIsAsIfOnlyTheNewOneHadComeEver) {
  PointStore store = create(), expected = create("expected");
  const std::int64_t old = ingest(first_cloud(), store).source.id;
  const IngestReport report = ingest(second_cloud(), store, replacing(old));
  EXPECT_FALSE(report.already_present);
  ASSERT_EQ(store.sources().size(), 1u);
  EXPECT_EQ(store.sources().front().id, report.source.id);
  ingest(second_cloud(), expected);
  EXPECT_EQ(content_of(store), content_of(expected));
  EXPECT_TRUE(store.verify(true).empty());
  EXPECT_EQ(db::Database(path(), db::OpenMode::kRead).query_int("SELECT count(*) FROM sources"), 1);
}

TEST_F(ChangeTest, ReplacingByWhatIsThereAlreadyRemovesTheOldOneOnce) {
  PointStore store = create(), expected = create("expected");
  const std::int64_t old = ingest(first_cloud(), store).source.id;
  ingest(second_cloud(), store);
  EXPECT_TRUE(ingest(second_cloud(), store, replacing(old)).already_present);
  EXPECT_EQ(store.sources().size(), 1u);
  ingest(second_cloud(), expected);
  EXPECT_EQ(content_of(store), content_of(expected));
  const std::int64_t self = store.sources().front().id;
  EXPECT_TRUE(ingest(second_cloud(), store, replacing(self)).already_present);
  EXPECT_EQ(store.sources().size(), 1u);
}

TEST_F(ChangeTest, ReplacingASourceThatIsNotThereIsRefusedBeforeReading) {
  PointStore store = create();
  ingest(first_cloud(), store);
  MemoryReader reader(second_cloud());
  const Error error = error_of([&] {
    static_cast<void>(ingest_points(reader, "memory", kLattice, store, replacing(7), {}));
  });
  EXPECT_EQ(error.code(), ErrorCode::kUsage);
  EXPECT_NE(std::string(error.what()).find("no source 7"), std::string::npos) << error.what();
  EXPECT_EQ(store.sources().size(), 1u);
}

TEST_F(ChangeTest, AFailedReplacementLeavesTheOldSource) {
  class DamagedReader : public MemoryReader {
   public:
    using MemoryReader::MemoryReader;
    [[nodiscard]] std::size_t read(std::span<Vector3> points) override {
      const std::size_t count = MemoryReader::read(points);
      if (count == 0) throw Error(ErrorCode::kCorrupt, "file ends");
      return count;
    }
  };
  PointStore store = create();
  const std::int64_t old = ingest(first_cloud(), store).source.id;
  const Content before = content_of(store);
  DamagedReader reader(second_cloud());
  EXPECT_THROW(
      static_cast<void>(ingest_points(reader, "memory", kLattice, store, replacing(old), {})),
      Error);
  EXPECT_EQ(content_of(store), before);
  EXPECT_EQ(store.sources().front().id, old);
}

TEST_F(ChangeTest, ARegionIsHalfOpenAndCountsWhatIsOutside) {
  PointStore store = create();
  IngestOptions options;
  options.region = Box3(Vector3(0, 0, 0), Vector3(1, 1, 1));
  options.transform.scale = 0.5;  // the box is in the map's frame and units
  const IngestReport report =
      ingest({{0, 0, 0}, {1.9, 1, 1}, {2, 1, 1}, {1, -0.1, 1}, {1, 1, 2}}, store, options);
  EXPECT_EQ(report.source.counts.num_stored, 2u);
  EXPECT_EQ(report.source.counts.num_rejected_outside, 3u);
  EXPECT_EQ(report.source.counts.num_read, 5u);
  EXPECT_TRUE(store.verify(true).empty());
}

TEST_F(ChangeTest, RegionsThatShareAFacePartitionACloud) {
  PointStore whole = create("whole"), halves = create("halves");
  ingest(first_cloud(), whole);
  const double far = 1e6;
  for (const auto& [low, high] : {std::pair(-far, 0.25), std::pair(0.25, far)}) {
    IngestOptions options;
    options.region = Box3(Vector3(low, -far, -far), Vector3(high, far, far));
    EXPECT_FALSE(ingest(first_cloud(), halves, options).already_present);
  }
  EXPECT_EQ(content_of(halves).points, content_of(whole).points);
  EXPECT_EQ(halves.totals().num_points, whole.totals().num_points);
}

TEST_F(ChangeTest, RegionsThatHoldNothingAreRefused) {
  PointStore store = create();
  IngestOptions options;
  for (const Vector3& max : {Vector3(1, 1, 0), Vector3(1, -1, 1), Vector3(1, 1, std::nan(""))}) {
    options.region = Box3(Vector3::Zero(), max);
    EXPECT_EQ(error_of([&] { ingest({{1, 1, 1}}, store, options); }).code(), ErrorCode::kUsage);
  }
}

TEST_F(ChangeTest, CompactingMergesBlocksAndChangesNoPointNorDigest) {
  for (const int voxel_steps : {0, 800}) {
    SCOPED_TRACE(voxel_steps);
    const std::string name = std::to_string(voxel_steps);
    PointStore store = fragmented(path(name), voxel_steps);
    const Content before = content_of(store);
    const PointStore::Totals totals = store.totals();
    const std::uint64_t parts = num_parts(path(name));
    ASSERT_GT(totals.num_blocks, 4 * parts);
    const CompactReport report = store.compact();
    EXPECT_EQ(content_of(store), before);
    EXPECT_TRUE(store.verify(true).empty());
    EXPECT_GT(report.num_merged, 0u);
    EXPECT_EQ(report.num_blocks_before, totals.num_blocks);
    EXPECT_EQ(report.num_blocks_after, parts);
    EXPECT_EQ(store.totals().num_blocks, report.num_blocks_after);
    EXPECT_LT(store.totals().num_points, totals.num_points);
    EXPECT_LT(report.file_bytes_after, report.file_bytes_before);
    EXPECT_EQ(store.compact().num_merged, 0u);
  }
}

TEST_F(ChangeTest, CompactingATileOfManyFullBlocksOrdersThem) {
  std::vector<Vector3> points = wavy_surface(1'200'000, 5, 7.9);
  for (Vector3& p : points) p += Vector3(4, 4, 4);
  PointStore store = create();
  ingest(points, store);
  ASSERT_EQ(store.totals().num_tiles, 1u);
  const Content before = content_of(store);
  const std::uint64_t bytes = store.totals().block_bytes;
  EXPECT_EQ(store.compact().num_merged, 1u);
  EXPECT_EQ(content_of(store), before);
  EXPECT_LT(store.totals().block_bytes, bytes);
  EXPECT_EQ(store.compact().num_merged, 0u);
  EXPECT_TRUE(store.verify(true).empty());
}

TEST_F(ChangeTest, CompactingAskedToStopEndsAndGoesOnWhenCalledAgain) {
  PointStore store = fragmented(path());
  const Content before = content_of(store);
  std::atomic<bool> stop = true;
  EXPECT_EQ(error_of([&] { store.compact({.stop = &stop}); }).code(), ErrorCode::kInterrupted);
  EXPECT_EQ(content_of(store), before);
  EXPECT_TRUE(store.verify(true).empty());
  store.compact();
  EXPECT_EQ(content_of(store), before);
  EXPECT_EQ(store.totals().num_blocks, num_parts(path()));
}

TEST_F(ChangeTest, CompactingNamesADamagedBlockAndLeavesIt) {
  { fragmented(path()); }
  db::Database(path(), db::OpenMode::kWrite)
      .execute("UPDATE blocks SET data = x'01' WHERE id = (SELECT max(id) FROM blocks)");
  PointStore store(path(), db::OpenMode::kWrite);
  const Error error = error_of([&] { store.compact(); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_NE(std::string(error.what()).find("of source 2 (part) is damaged"), std::string::npos)
      << error.what();
  EXPECT_EQ(store.verify(true).size(), 2u);  // the same block: its size and its checksum
}

std::string awaited_place;

void kill_here(const char* name) {
  if (awaited_place == name) ::kill(::getpid(), SIGKILL);
}

/// Runs `work` in a child that is killed at a failpoint; whether it was.
bool killed_at(const char* place, const std::function<void()>& work) {
  const pid_t child = ::fork();
  if (child == 0) {
    awaited_place = place;
    set_failpoint_handler(kill_here);
    work();
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
}

TEST_F(ChangeTest, CompactingKilledAroundACommitLosesNothingAndGoesOn) {
  Content expected;
  {
    PointStore store = fragmented(path("expected"));
    expected = content_of(store);
  }
  for (const char* const place : {"compact.before_commit", "compact.after_commit"}) {
    SCOPED_TRACE(place);
    std::filesystem::copy_file(path("expected"), path(place));
    ASSERT_TRUE(killed_at(place, [&] { PointStore(path(place), db::OpenMode::kWrite).compact(); }));
    PointStore store(path(place), db::OpenMode::kWrite);
    EXPECT_EQ(content_of(store), expected);
    EXPECT_TRUE(store.verify(true).empty());
    store.compact();
    EXPECT_EQ(content_of(store), expected);
    EXPECT_EQ(store.totals().num_blocks, num_parts(path(place)));
  }
}

TEST_F(ChangeTest, ReplacementKilledAroundItsCommitHasTheOldOrTheNewAndNeverBoth) {
  PointStore old_alone = create("old"), new_alone = create("new");
  ingest(first_cloud(), old_alone);
  ingest(second_cloud(), new_alone);
  const Content with_old = content_of(old_alone), with_new = content_of(new_alone);
  for (const char* const place : {"ingest.before_publish", "ingest.after_publish",
                                  "discard.before_commit", "discard.after_commit"}) {
    SCOPED_TRACE(place);
    const bool published = std::string(place) != "ingest.before_publish";
    {
      PointStore store = create(place);
      ingest(first_cloud(), store);
    }
    ASSERT_TRUE(killed_at(place, [&] {
      PointStore store(path(place), db::OpenMode::kWrite);
      ingest(second_cloud(), store, replacing(1));
    }));
    PointStore store(path(place), db::OpenMode::kWrite);
    EXPECT_EQ(content_of(store), published ? with_new : with_old);
    if (!published) ingest(second_cloud(), store, replacing(1));
    EXPECT_EQ(content_of(store), with_new);
    EXPECT_TRUE(store.verify(true).empty());
  }
}

TEST_F(ChangeTest, RemovalKilledAroundItsCommitIsWholeOrDidNotHappen) {
  PointStore both = create("both"), alone = create("alone");
  ingest(first_cloud(), both);
  ingest(second_cloud(), both);
  ingest(first_cloud(), alone);
  const Content with_both = content_of(both), with_first = content_of(alone);
  for (const char* const place : {"remove.before_commit", "remove.after_commit",
                                  "discard.before_commit", "discard.after_commit"}) {
    SCOPED_TRACE(place);
    const bool removed = std::string(place) != "remove.before_commit";
    {
      PointStore store = create(place);
      ingest(first_cloud(), store);
      ingest(second_cloud(), store);
    }
    ASSERT_TRUE(killed_at(place, [&] { PointStore(path(place), db::OpenMode::kWrite).remove(2); }));
    PointStore store(path(place), db::OpenMode::kWrite);
    EXPECT_EQ(content_of(store), removed ? with_first : with_both);
    if (!removed) store.remove(2);
    store.compact();
    EXPECT_EQ(content_of(store), with_first);
    EXPECT_TRUE(store.verify(true).empty());
    const std::string all = "SELECT count(*) FROM sources";  // those that are not published too
    EXPECT_EQ(db::Database(path(place), db::OpenMode::kRead).query_int(all), 1);
  }
}

}  // namespace
}  // namespace gdfmap
