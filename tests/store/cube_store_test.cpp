#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <gdfmap/core/failpoint.hpp>
#include <gdfmap/db/database.hpp>
#include <gdfmap/store/cube_store.hpp>
#include <gdfmap/store/surroundings.hpp>
#include <gdfmap/store/tile_codec.hpp>

#include "sample_tiles.hpp"

namespace gdfmap {
namespace {

using db::OpenMode;
using test::sample_tile;

/// A directory of its own for every test, with the path of a database in it.
class CubeStoreTest : public ::testing::Test {
 protected:
  void SetUp() override {
    directory_ = std::filesystem::path(::testing::TempDir()) /
                 (std::string("cube_store_") +
                  ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(directory_);
    std::filesystem::create_directories(directory_);
    path_ = directory_ / "cubes.db";
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  CubeStore create() { return CubeStore(path_, OpenMode::kCreate); }
  CubeStore read_only() { return CubeStore(path_, OpenMode::kRead); }
  /// Changes the file behind the store's back.
  void tamper(const std::string& sql) { db::Database(path_, OpenMode::kWrite).execute(sql); }

  std::filesystem::path directory_;
  std::filesystem::path path_;
};

/// The error that an action throws, or a failure.
template <typename Action>
Error error_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "nothing was thrown";
  return Error(ErrorCode::kInternal, "");
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_F(CubeStoreTest, ReadsBackWhatWasPut) {
  const TileRecord tile = sample_tile({1, -2, 3, -4}, 5);
  create().put({&tile, 1});
  const std::optional<TileRecord> read = read_only().read(tile.key);
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->key, tile.key);
  EXPECT_EQ(read->surroundings, tile.surroundings);
  EXPECT_EQ(read->configuration, tile.configuration);
  EXPECT_EQ(encode_tile(*read), encode_tile(tile));
  EXPECT_FALSE(read_only().read({0, -2, 3, -4}).has_value());
}

TEST_F(CubeStoreTest, SummarisesATileInItsState) {
  TileRecord tile = sample_tile({0, 1, 2, 3}, 5);
  tile.cubes[0].errors.mae = 0.25f;
  tile.cubes[1].errors.mae = 0.75f;
  tile.cubes[3].errors.mae = NAN;  // imported without an error
  tile.cubes[0].cube_class = tile.cubes[1].cube_class = CubeClass::kPopulated;
  tile.cubes[3].cube_class = CubeClass::kUnknown;
  CubeStore store = create();
  store.put({&tile, 1});
  const std::optional<TileState> state = store.find_state(tile.key);
  ASSERT_TRUE(state.has_value());
  EXPECT_EQ(state->key, tile.key);
  EXPECT_EQ(state->surroundings, surroundings_digest(tile.key, tile.surroundings));
  EXPECT_TRUE(state->served.test(0) && state->served.test(7) && state->served.test(511));
  EXPECT_EQ(state->served.count(), 3) << "the failed cube serves nobody";
  EXPECT_EQ(state->configuration, tile.configuration);
  EXPECT_EQ(state->content, content_digest(tile));
  EXPECT_EQ(state->num_cubes, 4);
  EXPECT_EQ(state->num_populated, 2);
  EXPECT_EQ(state->num_poor, 1);
  EXPECT_EQ(state->num_failed, 1);
  EXPECT_EQ(state->num_gaussians, 8 + 16 + 3);
  EXPECT_EQ(state->num_measured, 2);
  EXPECT_EQ(state->mean_mae, 0.5);
  EXPECT_EQ(state->max_mae, 0.75);
  EXPECT_EQ(state->num_bytes, static_cast<std::int64_t>(encode_tile(tile).size()));
  EXPECT_FALSE(store.find_state({0, 3, 2, 1}).has_value());
}

TEST_F(CubeStoreTest, ListsStatesInKeyOrderWhateverTheOrderOfWriting) {
  const TileRecord tiles[] = {sample_tile({1, 0, 0, 0}, 1), sample_tile({0, 5, -1, 0}, 2),
                              sample_tile({0, -5, 0, 0}, 3), sample_tile({0, 5, -1, -1}, 4)};
  CubeStore store = create();
  store.put(tiles);
  std::vector<TileKey> keys;
  store.for_each_state([&](const TileState& state) { keys.push_back(state.key); });
  EXPECT_EQ(keys,
            (std::vector<TileKey>{{0, -5, 0, 0}, {0, 5, -1, -1}, {0, 5, -1, 0}, {1, 0, 0, 0}}));
}

TEST_F(CubeStoreTest, ContentDigestDependsOnTheCubesAndNotOnTheWayThere) {
  const TileRecord a = sample_tile({0, 1, 0, 0}, 1), b = sample_tile({0, 2, 0, 0}, 2);
  TileRecord looked_at_in_vain;
  looked_at_in_vain.key = {0, 3, 0, 0};
  CubeStore one = create();
  EXPECT_EQ(one.content_digest(), hash128({}));
  one.put({&a, 1});
  one.put({&b, 1});

  CubeStore other(directory_ / "other.db", OpenMode::kCreate);
  const TileRecord former = sample_tile(a.key, 9);
  other.put({&b, 1});
  other.put({&former, 1});
  EXPECT_NE(one.content_digest(), other.content_digest());
  const TileRecord rest[] = {looked_at_in_vain, a};
  other.put(rest);
  EXPECT_EQ(one.content_digest(), other.content_digest());

  ByteWriter digests;
  digests.put(content_digest(a));
  digests.put(content_digest(b));
  EXPECT_EQ(one.content_digest(), hash128(digests.bytes()));
}

TEST_F(CubeStoreTest, PutReplacesATileAndItsCubes) {
  const TileRecord former = sample_tile({0, 1, 0, 0}, 1);
  TileRecord latter = sample_tile({0, 1, 0, 0}, 2);
  latter.cubes.pop_back();
  CubeStore store = create();
  store.put({&former, 1});
  store.put({&latter, 1});
  EXPECT_EQ(encode_tile(store.read(latter.key).value()), encode_tile(latter));
  EXPECT_EQ(store.totals().num_tiles, 1);
  EXPECT_TRUE(store.verify(true).empty());
}

TEST_F(CubeStoreTest, EraseRemovesTilesAndIgnoresAbsentOnes) {
  const TileRecord tiles[] = {sample_tile({0, 1, 0, 0}, 1), sample_tile({0, 2, 0, 0}, 2)};
  CubeStore store = create();
  store.put(tiles);
  const TileKey keys[] = {{0, 7, 7, 7}, tiles[0].key};
  store.erase(keys);
  EXPECT_FALSE(store.read(tiles[0].key).has_value());
  EXPECT_TRUE(store.read(tiles[1].key).has_value());
  EXPECT_TRUE(store.verify(true).empty());
}

TEST_F(CubeStoreTest, AddsUpTotals) {
  TileRecord a = sample_tile({0, 1, 0, 0}, 1), b = sample_tile({1, 1, 0, 0}, 2);
  a.cubes.resize(1);
  a.cubes[0].errors.mae = 1.0f;
  for (CubeRecord& cube : b.cubes) cube.errors.mae = 3.0f;
  CubeStore store = create();
  EXPECT_EQ(store.totals().num_tiles, 0);
  EXPECT_FALSE(store.has_cubes());
  store.put({&a, 1});
  store.put({&b, 1});
  const CubeTotals totals = store.totals();
  EXPECT_TRUE(store.has_cubes());
  EXPECT_EQ(totals.num_tiles, 2);
  EXPECT_EQ(totals.num_cubes, 5);
  EXPECT_EQ(totals.num_poor, 1);
  EXPECT_EQ(totals.num_failed, 1);
  EXPECT_EQ(totals.num_gaussians, 8 + 27);
  EXPECT_EQ(totals.num_measured, 4);
  EXPECT_DOUBLE_EQ(totals.mean_mae, (1.0 + 3 * 3.0) / 4);
  EXPECT_EQ(totals.num_bytes,
            static_cast<std::int64_t>(encode_tile(a).size() + encode_tile(b).size()));
}

TEST_F(CubeStoreTest, ATileWithoutCubesCountsAsLookedAtButNotAsContent) {
  TileRecord tile;
  tile.key = {0, 1, 2, 3};
  tile.surroundings = {{tile.key, {4, 5}}};
  CubeStore store = create();
  store.put({&tile, 1});
  EXPECT_EQ(store.read(tile.key).value().surroundings, tile.surroundings);
  EXPECT_TRUE(store.read(tile.key).value().cubes.empty());
  EXPECT_FALSE(store.has_cubes());
}

TEST_F(CubeStoreTest, KeepsOccupiedTilesInKeyOrder) {
  OccupiedTile a{{0, 5, 0, 0}, {}}, b{{0, -5, 3, 0}, {}};
  a.cubes.set(0);
  a.cubes.set(511);
  b.cubes.set(64);
  CubeStore store = create();
  const OccupiedTile given[] = {a, b};
  store.set_occupied(given);
  EXPECT_EQ(read_only().occupied(), (std::vector<OccupiedTile>{b, a}));
  store.set_occupied({&a, 1});
  EXPECT_EQ(store.occupied(), std::vector<OccupiedTile>{a});
}

TEST_F(CubeStoreTest, WritesTheOccupiedTilesOnlyWhenTheyDiffer) {
  OccupiedTile a{{0, 5, 0, 0}, {}}, b{{0, -5, 3, 0}, {}};
  a.cubes.set(1);
  b.cubes.set(2);
  const OccupiedTile one_order[] = {a, b}, other_order[] = {b, a};
  create().set_occupied(one_order);
  const auto version = [&] {
    db::Database observer(path_, OpenMode::kRead);
    return observer.query_int("SELECT max(rowid) FROM occupied");
  };
  tamper("UPDATE occupied SET rowid = rowid + 100");
  const std::int64_t before = version();
  create().set_occupied(other_order);
  EXPECT_EQ(version(), before);  // rows written anew would have small ids
}

TEST_F(CubeStoreTest, KeepsMetaData) {
  CubeStore store = create();
  EXPECT_FALSE(store.meta("map_id").has_value());
  store.set_meta("map_id", "one");
  store.set_meta("map_id", "two");
  EXPECT_EQ(store.meta("map_id"), "two");
}

TEST_F(CubeStoreTest, NamesTheTileWhoseBytesAreDamaged) {
  const TileRecord tiles[] = {sample_tile({0, 1, -2, 3}, 1), sample_tile({0, 2, 0, 0}, 2)};
  create().put(tiles);
  tamper(
      "UPDATE tile_blobs SET data = substr(data, 1, 40) || x'ff' || substr(data, 42) "
      "WHERE tile = (SELECT id FROM tiles WHERE x = 1)");
  CubeStore store = read_only();
  const Error error = error_of([&] { static_cast<void>(store.read(tiles[0].key)); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_TRUE(contains(error.what(), path_.string() + ": tile 0,1,-2,3: checksum")) << error.what();
  EXPECT_TRUE(store.read(tiles[1].key).has_value());
  EXPECT_TRUE(store.find_state(tiles[0].key).has_value());
}

TEST_F(CubeStoreTest, VerifyReportsEveryFault) {
  TileRecord tiles[7];
  for (int i = 0; i < 7; ++i) tiles[i] = sample_tile({0, i, 0, 0}, static_cast<std::uint32_t>(i));
  create().put(tiles);
  EXPECT_TRUE(read_only().verify(true).empty());
  const auto of = [](int x) {
    return " = (SELECT id FROM tiles WHERE x = " + std::to_string(x) + ")";
  };
  tamper("UPDATE tile_blobs SET data = zeroblob(length(data)) WHERE tile" + of(1));
  tamper("UPDATE tiles SET content = zeroblob(16) WHERE x = 2");
  tamper("UPDATE tiles SET num_poor = 0 WHERE x = 3");
  EXPECT_TRUE(read_only().verify(false).empty());  // only the bytes tell
  const std::vector<std::string> deep = read_only().verify(true);
  ASSERT_EQ(deep.size(), 3u);
  EXPECT_TRUE(contains(deep[0], "tile 0,1,0,0: checksum")) << deep[0];
  EXPECT_TRUE(contains(deep[1], "tile 0,2,0,0: content digest")) << deep[1];
  EXPECT_TRUE(contains(deep[2], "tile 0,3,0,0: cubes differ")) << deep[2];

  tamper("DELETE FROM tile_blobs WHERE tile" + of(4));
  tamper("UPDATE tile_blobs SET data = data || x'00' WHERE tile" + of(5));
  tamper("DELETE FROM tiles WHERE x = 6");
  const std::vector<std::string> quick = read_only().verify(false);
  ASSERT_EQ(quick.size(), 3u);
  EXPECT_TRUE(contains(quick[0], "tile 0,4,0,0: has no cubes")) << quick[0];
  EXPECT_TRUE(contains(quick[1], "tile 0,5,0,0: size")) << quick[1];
  EXPECT_TRUE(contains(quick[2], "1 tiles that do not exist")) << quick[2];
}

TEST_F(CubeStoreTest, VerifySurvivesADamagedFile) {
  std::vector<TileRecord> tiles;
  for (int i = 0; i < 60; ++i) {
    tiles.push_back(sample_tile({0, i, 0, 0}, static_cast<std::uint32_t>(i)));
  }
  create().put(tiles);
  const auto size = static_cast<std::streamoff>(std::filesystem::file_size(path_));
  {
    std::FILE* const file = std::fopen(path_.c_str(), "r+b");
    ASSERT_NE(file, nullptr);
    // Everything behind the first page, which holds the schema.
    ASSERT_EQ(std::fseek(file, db::kPageBytes, SEEK_SET), 0);
    for (std::streamoff i = db::kPageBytes; i < size; ++i) std::fputc(0x5a, file);
    std::fclose(file);
  }
  CubeStore store = read_only();
  EXPECT_FALSE(store.verify(true).empty());
  const Error error = error_of([&] { static_cast<void>(store.read({0, 1, 0, 0})); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt) << error.what();
}

TEST_F(CubeStoreTest, RefusesAnotherVersionAndAnotherKindOfFile) {
  static_cast<void>(create());
  tamper("PRAGMA user_version = 3000");
  const Error version = error_of([&] { static_cast<void>(read_only()); });
  EXPECT_EQ(version.code(), ErrorCode::kCorrupt);
  EXPECT_TRUE(contains(version.what(), "version 3")) << version.what();
  tamper("PRAGMA user_version = 2000; PRAGMA application_id = 1");
  EXPECT_EQ(error_of([&] { static_cast<void>(read_only()); }).code(), ErrorCode::kCorrupt);
}

TEST_F(CubeStoreTest, RefusesADatabaseThatLacksATable) {
  static_cast<void>(create());
  tamper("DROP TABLE occupied");
  const Error error = error_of([&] { static_cast<void>(read_only()); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_TRUE(contains(error.what(), "table")) << error.what();
}

TEST_F(CubeStoreTest, ReadOnlyStoreRefusesToWrite) {
  const TileRecord tile = sample_tile({0, 1, 0, 0}, 1);
  static_cast<void>(create());
  for (const OpenMode mode : {OpenMode::kRead, OpenMode::kImmutable}) {
    CubeStore store(path_, mode);
    EXPECT_EQ(error_of([&] { store.put({&tile, 1}); }).code(), ErrorCode::kIo);
    EXPECT_FALSE(store.has_cubes());
  }
}

TEST_F(CubeStoreTest, MissingFileIsAnInputError) {
  const Error error = error_of([&] { static_cast<void>(read_only()); });
  EXPECT_EQ(error.code(), ErrorCode::kIo);
  EXPECT_TRUE(contains(error.what(), path_.string()));
}

TEST_F(CubeStoreTest, ReadersSeeWholeTransactionsBesideAWriter) {
  const TileRecord tile = sample_tile({0, 1, 0, 0}, 1), other = sample_tile({0, 2, 0, 0}, 2);
  CubeStore writer = create();
  writer.put({&tile, 1});
  CubeStore reader = read_only();
  EXPECT_TRUE(reader.read(tile.key).has_value());
  EXPECT_FALSE(reader.read(other.key).has_value());
  writer.put({&other, 1});
  EXPECT_TRUE(reader.read(other.key).has_value());  // no statement holds the old snapshot
}

TEST_F(CubeStoreTest, LeavesOnePlainFileWhenAWriterCloses) {
  const TileRecord tile = sample_tile({0, 1, 0, 0}, 1);
  {
    CubeStore store = create();
    store.put({&tile, 1});
    EXPECT_TRUE(store.read(tile.key).has_value());
    EXPECT_TRUE(std::filesystem::exists(path_.string() + "-wal"));
    CubeStore moved = std::move(store);
    store = std::move(moved);
  }
  std::size_t num_files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(directory_)) {
    ++num_files;
  }
  EXPECT_EQ(num_files, 1u);
  EXPECT_TRUE(CubeStore(path_, OpenMode::kImmutable).read(tile.key).has_value());
}

TEST_F(CubeStoreTest, AFailureBeforeTheCommitLeavesTheFormerTiles) {
  const TileRecord former = sample_tile({0, 1, 0, 0}, 1);
  const TileRecord latter[] = {sample_tile({0, 1, 0, 0}, 2), sample_tile({0, 2, 0, 0}, 3)};
  CubeStore store = create();
  store.put({&former, 1});
  set_failpoint_handler([](const char* name) {
    if (std::string(name) == "train.before_commit") throw std::runtime_error("stop");
  });
  EXPECT_THROW(store.put(latter), std::runtime_error);
  EXPECT_EQ(store.totals().num_tiles, 1);
  EXPECT_EQ(store.find_state(former.key).value().content, content_digest(former));

  set_failpoint_handler([](const char* name) {
    if (std::string(name) == "train.after_commit") throw std::runtime_error("stop");
  });
  EXPECT_THROW(store.put(latter), std::runtime_error);
  set_failpoint_handler(nullptr);
  EXPECT_EQ(store.totals().num_tiles, 2);
  EXPECT_EQ(store.find_state(former.key).value().content, content_digest(latter[0]));
}

TEST_F(CubeStoreTest, OneBadTileKeepsTheWholeBatchOut) {
  TileRecord tiles[] = {sample_tile({0, 1, 0, 0}, 1), sample_tile({0, 2, 0, 0}, 2)};
  tiles[1].cubes[0].gaussians.at(kWeight, 0) = NAN;
  CubeStore store = create();
  EXPECT_EQ(error_of([&] { store.put(tiles); }).code(), ErrorCode::kInternal);
  EXPECT_EQ(store.totals().num_tiles, 0);
}

}  // namespace
}  // namespace gdfmap
