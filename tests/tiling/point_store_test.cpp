#include <fstream>

#include <gtest/gtest.h>

#include <gdfmap/tiling/point_store.hpp>

#include "tiling_fixtures.hpp"

namespace gdfmap {
namespace {

using PointStoreTest = TilingTest;

NewBlock block_of(const TileKey& tile, std::vector<TileOffset> points) {
  sort_unique(points);
  NewBlock block;
  block.tile = tile;
  block.num_points = static_cast<std::uint32_t>(points.size());
  for (const TileOffset& p : points) block.cubes.set(p.cube());
  block.digest = hash128(std::as_bytes(std::span(points)));
  block.data = encode_block(points);
  return block;
}

SourceRecord record(std::int64_t id, std::uint64_t identity, std::uint64_t num_stored) {
  SourceRecord source;
  source.id = id;
  source.identity = {identity, ~identity};
  source.num_bytes = 100 + identity;
  source.counts = {.num_read = num_stored, .num_stored = num_stored};
  return source;
}

/// Publishes a source whose blocks are those given.
std::int64_t publish(PointStore& store, std::uint64_t identity,
                     const std::vector<NewBlock>& blocks) {
  const std::int64_t id = store.begin_source("cloud-" + std::to_string(identity), "scale=1");
  store.append(id, blocks);
  std::uint64_t num_points = 0;
  for (const NewBlock& block : blocks) num_points += block.num_points;
  store.publish(record(id, identity, num_points));
  return id;
}

std::vector<TileKey> keys(PointStore& store) {
  std::vector<TileKey> result;
  store.for_each_tile([&](const TilePoints& tile) { result.push_back(tile.key); });
  return result;
}

TEST_F(PointStoreTest, KeepsWhatItIsTold) {
  {
    PointStore store = create();
    EXPECT_FALSE(store.meta("map_id"));
    store.set_meta("map_id", "a");
    store.set_meta("map_id", "b");
    const std::int64_t id = store.begin_source("dir/a cloud.ply", "scale=2");
    store.append(id, std::vector{block_of({0, 1, 2, 3}, {{1, 2, 3}, {9000, 0, 0}})});
    SourceRecord source = record(id, 7, 2);
    source.counts = {.num_read = 36,
                     .num_stored = 2,
                     .num_duplicates = 3,
                     .num_thinned = 8,
                     .num_rejected_not_finite = 1,
                     .num_rejected_withheld = 4,
                     .num_rejected_zero = 5,
                     .num_rejected_out_of_range = 6,
                     .num_rejected_outside = 7};
    store.publish(source);
  }
  PointStore store(path(), db::OpenMode::kRead);
  EXPECT_EQ(store.meta("map_id"), "b");
  ASSERT_EQ(store.sources().size(), 1u);
  const SourceRecord source = store.sources().front();
  EXPECT_EQ(source.path, "dir/a cloud.ply");
  EXPECT_EQ(source.parameters, "scale=2");
  EXPECT_EQ(source.identity, (Digest{7, ~std::uint64_t{7}}));
  EXPECT_EQ(source.num_bytes, 107u);
  EXPECT_EQ(source.counts.num_read, 36u);
  EXPECT_EQ(source.counts.num_duplicates, 3u);
  EXPECT_EQ(source.counts.num_thinned, 8u);
  EXPECT_EQ(source.counts.num_rejected(), 23u);
  EXPECT_EQ(store.find_source(source.identity)->id, source.id);
  EXPECT_FALSE(store.find_source({1, 2}));
  EXPECT_TRUE(store.has_source_of_size(107));
  EXPECT_FALSE(store.has_source_of_size(108));
  EXPECT_TRUE(store.verify(true).empty());
}

TEST_F(PointStoreTest, ListsTilesInKeyOrderWithTheUnionOfTheirCubes) {
  PointStore store = create();
  publish(store, 1,
          {block_of({0, 5, 0, 0}, {{0, 0, 0}}), block_of({0, -5, 7, 0}, {{1, 1, 1}}),
           block_of({0, 5, -1, 9}, {{0, 0, 0}}), block_of({0, 5, 0, 0}, {{65535, 0, 0}})});
  publish(store, 2, {block_of({0, 5, 0, 0}, {{0, 65535, 65535}, {0, 0, 0}})});
  EXPECT_EQ(keys(store), (std::vector<TileKey>{{0, -5, 7, 0}, {0, 5, -1, 9}, {0, 5, 0, 0}}));

  const auto tile = store.find_tile({0, 5, 0, 0});
  ASSERT_TRUE(tile);
  EXPECT_EQ(tile->num_points, 4u);
  EXPECT_EQ(tile->cubes.count(), 3);
  EXPECT_TRUE(tile->cubes.test(cube_index(0, 0, 0)));
  EXPECT_TRUE(tile->cubes.test(cube_index(7, 0, 0)));
  EXPECT_TRUE(tile->cubes.test(cube_index(0, 7, 7)));
  EXPECT_FALSE(store.find_tile({0, 5, 0, 1}));
  store.for_each_tile([&](const TilePoints& listed) {
    const auto found = store.find_tile(listed.key);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->digest, listed.digest);
    EXPECT_EQ(found->cubes, listed.cubes);
    EXPECT_EQ(found->num_points, listed.num_points);
  });
}

TEST_F(PointStoreTest, VisitsTheBlocksOfATileInOrder) {
  PointStore store = create();
  publish(store, 1,
          {block_of({0, 0, 0, 0}, {{1, 0, 0}}), block_of({0, 1, 0, 0}, {{7, 0, 0}}),
           block_of({0, 0, 0, 0}, {{2, 0, 0}})});
  publish(store, 2, {block_of({0, 0, 0, 0}, {{1, 0, 0}, {3, 0, 0}})});
  std::vector<TileOffset> seen;
  store.for_each_block({0, 0, 0, 0}, [&](std::span<const TileOffset> points) {
    seen.insert(seen.end(), points.begin(), points.end());
  });
  EXPECT_EQ(seen, (std::vector<TileOffset>{{1, 0, 0}, {2, 0, 0}, {1, 0, 0}, {3, 0, 0}}));
}

TEST_F(PointStoreTest, TotalsCountPublishedSourcesOnly) {
  PointStore store = create();
  EXPECT_EQ(store.totals().num_points, 0u);
  const NewBlock a = block_of({0, 0, 0, 0}, {{1, 0, 0}, {2, 0, 0}});
  const NewBlock b = block_of({0, 1, 0, 0}, {{1, 0, 0}});
  publish(store, 1, {a, b, a});
  publish(store, 2, {a});
  store.append(store.begin_source("unfinished", ""), std::vector{a, b});
  const PointStore::Totals totals = store.totals();
  EXPECT_EQ(totals.num_points, 7u);
  EXPECT_EQ(totals.num_blocks, 4u);
  EXPECT_EQ(totals.num_tiles, 2u);
  EXPECT_EQ(totals.block_bytes, 3 * a.data.size() + b.data.size());
}

TEST_F(PointStoreTest, AnUnpublishedSourceIsInvisibleAndTheNextWriterDeletesIt) {
  const NewBlock block = block_of({0, 0, 0, 0}, {{1, 2, 3}});
  {
    PointStore store = create();
    store.append(store.begin_source("unfinished", ""), std::vector{block});
    EXPECT_TRUE(keys(store).empty());
    EXPECT_FALSE(store.find_tile(block.tile));
    EXPECT_TRUE(store.sources().empty());
    EXPECT_FALSE(store.has_source_of_size(0));
    store.for_each_block(block.tile, [](auto) { ADD_FAILURE() << "a staged block was visited"; });
  }
  {
    PointStore store(path(), db::OpenMode::kWrite);
    EXPECT_EQ(store.begin_source("next", ""), 2);  // ids are not used again
  }
  db::Database database(path(), db::OpenMode::kRead);
  for (const char* const table : {"blocks", "tiles", "tile_sources"}) {
    EXPECT_EQ(database.query_int(std::string("SELECT count(*) FROM ") + table), 0) << table;
  }
}

TEST_F(PointStoreTest, DiscardTouchesNoOtherSource) {
  PointStore store = create();
  const NewBlock shared = block_of({0, 0, 0, 0}, {{1, 2, 3}});
  const std::int64_t published = publish(store, 1, {shared});
  const Content before = content_of(store);
  const std::int64_t staged = store.begin_source("staged", "");
  store.append(staged, std::vector{shared, block_of({0, 1, 0, 0}, {{1, 2, 3}})});
  store.discard(staged);
  store.discard(published);
  EXPECT_EQ(content_of(store), before);
  EXPECT_TRUE(store.verify(true).empty());
}

TEST_F(PointStoreTest, ARemovedSourceIsAsIfItHadNeverBeenThere) {
  PointStore store = create();
  const NewBlock shared = block_of({0, 0, 0, 0}, {{1, 2, 3}});
  publish(store, 1, {shared});
  const Content before = content_of(store);
  std::vector<NewBlock> blocks;  // more than one transaction deletes, in one tile and over many
  for (int i = 0; i < 5000; ++i) blocks.push_back(shared);
  for (int x = 1; x < 5000; ++x) blocks.push_back(block_of({0, x, 0, 0}, {{1, 2, 3}}));
  const std::int64_t id = publish(store, 2, blocks);
  EXPECT_NE(content_of(store), before);
  const auto size = [&] {
    return db::Database(path(), db::OpenMode::kRead).query_int("PRAGMA page_count");
  };
  const std::int64_t size_with_both = size();
  store.remove(id);
  EXPECT_EQ(content_of(store), before);
  EXPECT_EQ(store.sources().size(), 1u);
  EXPECT_LT(size(), size_with_both / 2);
  EXPECT_TRUE(store.verify(true).empty());
  EXPECT_EQ(error_of([&] { store.remove(id); }).code(), ErrorCode::kUsage);
}

TEST_F(PointStoreTest, ASourceIsPublishedOnce) {
  PointStore store = create();
  const std::int64_t id = publish(store, 1, {block_of({0, 0, 0, 0}, {{1, 2, 3}})});
  EXPECT_EQ(error_of([&] { store.publish(record(id, 2, 1)); }).code(), ErrorCode::kUsage);
  const std::int64_t again = store.begin_source("again", "");
  EXPECT_EQ(error_of([&] { store.publish(record(again, 1, 1)); }).code(), ErrorCode::kUsage);
  EXPECT_EQ(store.sources().size(), 1u);
}

TEST_F(PointStoreTest, AMovedStoreGoesOnWorking) {
  PointStore first = create();
  publish(first, 1, {block_of({0, 0, 0, 0}, {{1, 2, 3}})});
  PointStore second = std::move(first);
  publish(second, 2, {block_of({0, 1, 0, 0}, {{1, 2, 3}})});
  EXPECT_EQ(keys(second).size(), 2u);
  EXPECT_EQ(second.find_tile({0, 1, 0, 0})->num_points, 1u);
}

TEST_F(PointStoreTest, AReaderSeesEachPublicationWhileTheWriterGoesOn) {
  PointStore writer = create();
  publish(writer, 1, {block_of({0, 0, 0, 0}, {{1, 2, 3}})});
  PointStore reader(path(), db::OpenMode::kRead);
  const std::int64_t id = writer.begin_source("second", "");
  writer.append(id, std::vector{block_of({0, 1, 0, 0}, {{1, 2, 3}})});
  EXPECT_EQ(keys(reader).size(), 1u);
  writer.publish(record(id, 2, 1));
  EXPECT_EQ(keys(reader).size(), 2u);
}

TEST_F(PointStoreTest, AMapAtRestIsOnePlainFile) {
  { publish(*std::make_unique<PointStore>(create()), 1, {block_of({0, 0, 0, 0}, {{1, 2, 3}})}); }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory_.path()),
                          std::filesystem::directory_iterator()),
            1);
  PointStore reader(path(), db::OpenMode::kImmutable);
  EXPECT_EQ(keys(reader).size(), 1u);
}

TEST_F(PointStoreTest, ADamagedBlockIsNamed) {
  publish(*std::make_unique<PointStore>(create()), 1, {block_of({0, -3, 0, 4}, {{1, 2, 3}})});
  {
    db::Database database(path(), db::OpenMode::kWrite);
    db::Statement update(database, "UPDATE blocks SET data = ?");
    update.bind(block_of({0, 0, 0, 0}, {{1, 2, 4}}).data).run();
  }
  PointStore store(path(), db::OpenMode::kRead);
  const Error error = error_of([&] { store.for_each_block({0, -3, 0, 4}, [](auto) {}); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  const std::string fault = path().string() +
                            ": tile (-3, 0, 4), block 1 of source 1 (cloud-1) is damaged: its "
                            "checksum does not match";
  EXPECT_EQ(error.what(), fault);
  EXPECT_TRUE(store.verify(false).empty());
  EXPECT_EQ(store.verify(true), std::vector<std::string>{fault});
}

TEST_F(PointStoreTest, VerifyFindsCountsThatDoNotMatch) {
  publish(*std::make_unique<PointStore>(create()), 1,
          {block_of({0, 0, 0, 0}, {{1, 2, 3}}), block_of({0, 0, 0, 0}, {{1, 2, 4}})});
  const auto faults_after = [&](const char* sql) {
    db::Database(path(), db::OpenMode::kWrite).execute(sql);
    return PointStore(path(), db::OpenMode::kRead).verify(true).size();
  };
  EXPECT_EQ(faults_after("UPDATE sources SET num_read = 3"), 1u);
  EXPECT_EQ(faults_after("UPDATE sources SET num_read = 2"), 0u);
  EXPECT_EQ(faults_after("UPDATE blocks SET num_points = 2 WHERE id = 1"), 2u);
  EXPECT_EQ(faults_after("DELETE FROM blocks WHERE id = 1"), 1u);
  EXPECT_EQ(faults_after("DELETE FROM tile_sources"), 3u);  // of source, block and tile
}

TEST_F(PointStoreTest, VerifyFindsPointsInCubesThatTheirTileDoesNotList) {
  publish(*std::make_unique<PointStore>(create()), 1, {block_of({0, 0, 0, 0}, {{1, 2, 3}})});
  db::Database(path(), db::OpenMode::kWrite).execute("UPDATE tile_sources SET cubes_0 = 2");
  PointStore store(path(), db::OpenMode::kRead);
  EXPECT_EQ(store.verify(true),
            std::vector{path().string() +
                        ": tile (0, 0, 0), block 1 of source 1 (cloud-1) has points in cubes that "
                        "its tile does not list"});
}

TEST_F(PointStoreTest, SurvivesDamageAnywhereInTheFile) {
  {
    PointStore store = create();
    std::vector<NewBlock> blocks;
    for (int x = 0; x < 300; ++x) blocks.push_back(block_of({0, x, 0, 0}, {{1, 2, 3}, {4, 5, 6}}));
    publish(store, 1, blocks);
  }
  const auto size = static_cast<std::uint32_t>(std::filesystem::file_size(path()));
  std::mt19937 random(5);
  for (int trial = 0; trial < 200; ++trial) {
    std::filesystem::copy_file(path(), path("damaged.db"),
                               std::filesystem::copy_options::overwrite_existing);
    {
      std::fstream file(path("damaged.db"), std::ios::in | std::ios::out | std::ios::binary);
      for (int i = 0; i < 20; ++i) {
        file.seekp(random() % size).put(static_cast<char>(random()));
      }
    }
    try {
      PointStore store(path("damaged.db"), db::OpenMode::kRead);
      static_cast<void>(content_of(store));
      static_cast<void>(store.verify(true));
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()), "");
    }
  }
}

TEST_F(PointStoreTest, ForeignFilesAreRefused) {
  std::ofstream(path("text")) << "ply\nformat ascii 1.0\n";
  { db::Database(path("other"), db::OpenMode::kCreate).execute("CREATE TABLE theirs (a)"); }
  for (const char* const name : {"text", "other"}) {
    for (const db::OpenMode mode : {db::OpenMode::kCreate, db::OpenMode::kRead}) {
      const Error error = error_of([&] { const PointStore store(path(name), mode); });
      EXPECT_EQ(error.code(), ErrorCode::kCorrupt) << name;
      EXPECT_NE(std::string(error.what()).find(path(name).string()), std::string::npos);
    }
  }
  EXPECT_EQ(error_of([&] { const PointStore store(path("missing"), db::OpenMode::kRead); }).code(),
            ErrorCode::kIo);
}

TEST_F(PointStoreTest, AnotherMajorVersionIsRefused) {
  { const PointStore store = create(); }
  db::Database(path(), db::OpenMode::kWrite).execute("PRAGMA user_version = 3000");
  const Error error = error_of([&] { const PointStore store(path(), db::OpenMode::kWrite); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_EQ(error.what(), path().string() + " has format version 3, this build reads version 2");
}

TEST_F(PointStoreTest, SourcesOfAnOlderFileHaveNoSensorUntilAWriterAddsOne) {
  std::int64_t id = 0;
  {
    PointStore store = create();
    id = publish(store, 7, {block_of({0, 1, 2, 3}, {{1, 2, 3}})});
  }
  // What minor version 1 added goes again.
  db::Database(path(), db::OpenMode::kWrite)
      .execute(
          "ALTER TABLE sources DROP COLUMN sensor_x; ALTER TABLE sources DROP COLUMN sensor_y;"
          "ALTER TABLE sources DROP COLUMN sensor_z; ALTER TABLE sources DROP COLUMN alignment;"
          "PRAGMA user_version = 2000");
  PointStore reader(path(), db::OpenMode::kRead);
  ASSERT_EQ(reader.sources().size(), 1U);
  EXPECT_FALSE(reader.sources()[0].sensor_origin);
  EXPECT_EQ(reader.sources()[0].alignment, "");
  EXPECT_TRUE(reader.verify(true).empty());
  {
    PointStore writer(path(), db::OpenMode::kWrite);
    EXPECT_FALSE(writer.sources()[0].sensor_origin);
    writer.set_sensor_origin(id, {1.5, -2.25, 4.0e6});
    EXPECT_EQ(error_of([&] {
                writer.set_sensor_origin(id + 1, {0, 0, 0});
              }).code(),
              ErrorCode::kUsage);
  }
  EXPECT_EQ(reader.sources().size(), 1U);  // a reader that was there before goes on
  PointStore again(path(), db::OpenMode::kRead);
  EXPECT_EQ(again.sources()[0].sensor_origin, Vector3(1.5, -2.25, 4.0e6));
  EXPECT_TRUE(again.verify(true).empty());
}

TEST_F(PointStoreTest, SourcesOfOneSurveyAppearTogether) {
  PointStore store = create();
  const std::int64_t old = publish(store, 1, {block_of({0, 0, 0, 0}, {{1, 1, 1}})});
  std::vector<SourceRecord> sources;
  for (const std::uint64_t identity : {2u, 3u}) {
    sources.push_back(record(store.begin_source("part", ""), identity, 1));
    store.append(sources.back().id, std::vector{block_of({0, 1, 2, 3}, {{1, 2, 3}})});
  }
  EXPECT_EQ(store.sources().size(), 1U);
  store.publish(sources, old);
  ASSERT_EQ(store.sources().size(), 2U);
  EXPECT_EQ(store.sources()[0].id, sources[0].id);
  EXPECT_EQ(store.find_tile({0, 1, 2, 3})->num_points, 2U);
}

TEST_F(PointStoreTest, OneSourceThatCannotBePublishedKeepsTheOthersBack) {
  PointStore store = create();
  std::vector<SourceRecord> sources = {record(store.begin_source("a", ""), 2, 0),
                                       record(store.begin_source("b", ""), 3, 0)};
  sources[1].id += 10;  // never begun
  EXPECT_EQ(error_of([&] { store.publish(sources); }).code(), ErrorCode::kUsage);
  EXPECT_TRUE(store.sources().empty());
}

TEST_F(PointStoreTest, ListingAndLookupUseIndices) {
  { const PointStore store = create(); }
  db::Database database(path(), db::OpenMode::kRead);
  const auto plan = [&](const std::string& sql) {
    std::string text;
    db::Statement explain(database, "EXPLAIN QUERY PLAN " + sql);
    while (explain.step()) text += explain.text(3) + "\n";
    return text;
  };
  const std::string tiles = plan(
      "SELECT t.x FROM tiles t CROSS JOIN tile_sources ON tile = t.id "
      "JOIN sources s ON s.id = source WHERE s.published = 1 ORDER BY t.x, t.y, t.z");
  EXPECT_EQ(tiles.find("TEMP B-TREE"), std::string::npos) << tiles;
  const std::string blocks = plan(
      "SELECT b.data FROM tiles t JOIN blocks b ON b.tile = t.id "
      "JOIN sources s ON s.id = b.source WHERE t.x = 1 AND t.y = 2 AND t.z = 3 AND "
      "s.published = 1 ORDER BY b.source, b.sequence");
  EXPECT_NE(blocks.find("blocks_by_tile (tile=?"), std::string::npos) << blocks;
  EXPECT_EQ(blocks.find("SCAN"), std::string::npos) << blocks;
}

}  // namespace
}  // namespace gdfmap
