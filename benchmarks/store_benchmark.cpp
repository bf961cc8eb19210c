// Tiles into a cube store and out of it, against plain SQLite with the same blobs; opening a map of
// a million cubes and answering one query.

#include <stdexcept>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <sqlite3.h>

#include <gdfmap/db/database.hpp>
#include <gdfmap/map/map.hpp>
#include <gdfmap/query/distance_field.hpp>
#include <gdfmap/store/tile_codec.hpp>

#include "sample_map.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

constexpr int kNumTiles = 512;
constexpr int kTilesPerCommit = 16;
constexpr int kCubesPerSampleTile = 256;
constexpr std::size_t kGaussiansPerCube = 12;

TileKey key_of(int i) { return {0, i % 32, i / 32, 0}; }

std::vector<TileRecord> sample_tiles() {
  std::vector<TileRecord> tiles(kNumTiles, sample_tile({}, kCubesPerSampleTile, kGaussiansPerCube));
  for (int i = 0; i < kNumTiles; ++i) tiles[static_cast<std::size_t>(i)].key = key_of(i);
  return tiles;
}

/// A table of keys and blobs with the settings of a cube store and nothing more: no encoding, no
/// checksums, no digests.
class PlainSqlite {
 public:
  /// @param log  "WAL" as a store that is being written, "DELETE" as one that was closed
  PlainSqlite(const std::filesystem::path& path, const std::string& log) {
    check(sqlite3_open(path.c_str(), &handle_));
    execute("PRAGMA page_size = " + std::to_string(db::kPageBytes) +
            "; PRAGMA auto_vacuum = INCREMENTAL; PRAGMA journal_mode = " + log +
            "; PRAGMA synchronous = NORMAL; PRAGMA cache_size = -8192; "
            "CREATE TABLE IF NOT EXISTS tiles (id INTEGER PRIMARY KEY, level INTEGER, x INTEGER, "
            "y INTEGER, z INTEGER, data BLOB, UNIQUE (level, x, y, z))");
    prepare("INSERT OR REPLACE INTO tiles (level, x, y, z, data) VALUES (?, ?, ?, ?, ?)", insert_);
    prepare("SELECT data FROM tiles WHERE level = ? AND x = ? AND y = ? AND z = ?", select_);
  }
  ~PlainSqlite() {
    sqlite3_finalize(insert_);
    sqlite3_finalize(select_);
    sqlite3_close(handle_);
  }
  PlainSqlite(const PlainSqlite&) = delete;
  PlainSqlite& operator=(const PlainSqlite&) = delete;

  void execute(const std::string& sql) {
    check(sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr));
  }
  void put(const TileKey& key, const Bytes& data) {
    bind(insert_, key);
    check(sqlite3_bind_blob64(insert_, 5, data.data(), data.size(), SQLITE_STATIC));
    if (sqlite3_step(insert_) != SQLITE_DONE) throw std::runtime_error("insert failed");
  }
  [[nodiscard]] Bytes get(const TileKey& key) {
    bind(select_, key);
    if (sqlite3_step(select_) != SQLITE_ROW) throw std::runtime_error("no such tile");
    const auto* data = static_cast<const std::byte*>(sqlite3_column_blob(select_, 0));
    return {data, data + sqlite3_column_bytes(select_, 0)};
  }

 private:
  static void check(int code) {
    if (code != SQLITE_OK) throw std::runtime_error("SQLite failed");
  }
  void prepare(const char* sql, sqlite3_stmt*& statement) {
    check(sqlite3_prepare_v2(handle_, sql, -1, &statement, nullptr));
  }
  static void bind(sqlite3_stmt* statement, const TileKey& key) {
    sqlite3_reset(statement);
    check(sqlite3_bind_int(statement, 1, key.level));
    check(sqlite3_bind_int(statement, 2, key.x));
    check(sqlite3_bind_int(statement, 3, key.y));
    check(sqlite3_bind_int(statement, 4, key.z));
  }

  sqlite3* handle_ = nullptr;
  sqlite3_stmt* insert_ = nullptr;
  sqlite3_stmt* select_ = nullptr;
};

void count_tiles(benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * kNumTiles);
}

/// What training does on all its threads before one of them writes.
void encode_tiles(benchmark::State& state) {
  const std::vector<TileRecord> tiles = sample_tiles();
  for (auto _ : state) {
    for (const TileRecord& tile : tiles) benchmark::DoNotOptimize(encode(tile));
  }
  count_tiles(state);
}
BENCHMARK(encode_tiles)->Unit(benchmark::kMillisecond);

void put_into_store(benchmark::State& state) {
  std::vector<EncodedTile> tiles;
  for (const TileRecord& tile : sample_tiles()) tiles.push_back(encode(tile));
  for (auto _ : state) {
    const test::TemporaryDirectory directory;
    CubeStore store(directory / "cubes.db", db::OpenMode::kCreate);
    for (std::size_t i = 0; i < tiles.size(); i += kTilesPerCommit) {
      store.put(std::span(tiles).subspan(i, kTilesPerCommit));
    }
  }
  count_tiles(state);
}
BENCHMARK(put_into_store)->Unit(benchmark::kMillisecond)->UseRealTime();

void put_into_plain_sqlite(benchmark::State& state) {
  const Bytes data = encode_tile(sample_tiles().front());
  for (auto _ : state) {
    const test::TemporaryDirectory directory;
    PlainSqlite database(directory / "plain.db", "WAL");
    for (int i = 0; i < kNumTiles; ++i) {
      if (i % kTilesPerCommit == 0) database.execute("BEGIN IMMEDIATE");
      database.put(key_of(i), data);
      if ((i + 1) % kTilesPerCommit == 0) database.execute("COMMIT");
    }
  }
  count_tiles(state);
}
BENCHMARK(put_into_plain_sqlite)->Unit(benchmark::kMillisecond)->UseRealTime();

template <typename Read>
void read_tiles(benchmark::State& state, const Read& read) {
  const test::TemporaryDirectory directory;
  const std::vector<TileRecord> tiles = sample_tiles();
  CubeStore(directory / "cubes.db", db::OpenMode::kCreate).put(tiles);
  CubeStore store(directory / "cubes.db", db::OpenMode::kRead);
  for (auto _ : state) {
    for (const TileRecord& tile : tiles) benchmark::DoNotOptimize(read(store, tile.key));
  }
  count_tiles(state);
}

void read_from_store(benchmark::State& state) {
  read_tiles(state, [](CubeStore& store, const TileKey& key) { return store.read_encoded(key); });
}
BENCHMARK(read_from_store)->Unit(benchmark::kMillisecond)->UseRealTime();

/// The same with checksums and decoding, which threads do side by side.
void read_and_decode(benchmark::State& state) {
  read_tiles(state, [](CubeStore& store, const TileKey& key) { return store.read(key); });
}
BENCHMARK(read_and_decode)->Unit(benchmark::kMillisecond)->UseRealTime();

void read_from_plain_sqlite(benchmark::State& state, const char* log) {
  const test::TemporaryDirectory directory;
  const Bytes data = encode_tile(sample_tiles().front());
  PlainSqlite database(directory / "plain.db", log);
  for (int i = 0; i < kNumTiles; ++i) database.put(key_of(i), data);
  for (auto _ : state) {
    for (int i = 0; i < kNumTiles; ++i) benchmark::DoNotOptimize(database.get(key_of(i)));
  }
  count_tiles(state);
}
/// A file at rest, as a map is when nobody writes it.
BENCHMARK_CAPTURE(read_from_plain_sqlite, at_rest, "DELETE")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
/// A file whose log stays beside it spares a reader five system calls for each tile.
BENCHMARK_CAPTURE(read_from_plain_sqlite, with_log, "WAL")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// A million cubes: 8,000 tiles of 128 cubes, a quarter of them occupied, along a surface.
const std::filesystem::path& map_of_a_million_cubes() {
  static const test::TemporaryDirectory directory;
  static const std::filesystem::path path = [] {
    Map map = Map::create(directory / "million.gdfmap");
    std::vector<OccupiedTile> occupied;
    std::vector<TileRecord> window(kTilesPerCommit, sample_tile({}, 128, 10));
    for (int i = 0; i < 8000; ++i) {
      const TileKey key{0, i % 100, i / 100, (i % 7) - 3};
      window[static_cast<std::size_t>(i % kTilesPerCommit)].key = key;
      if ((i + 1) % kTilesPerCommit == 0) map.cubes().put(window);
      occupied.push_back({key, {}});
      for (int cube = 0; cube < 32; ++cube) occupied.back().cubes.set(4 * cube);
    }
    map.cubes().set_occupied(occupied);
    return map.path();
  }();
  return path;
}

void open_a_million_cubes_and_answer_one_query(benchmark::State& state) {
  const std::filesystem::path& path = map_of_a_million_cubes();
  for (auto _ : state) {
    const Map map = Map::open(path, Access::kRead);
    const DistanceField field(map);
    benchmark::DoNotOptimize(field.at({404.1, 320.3, 8.2}));
  }
}
BENCHMARK(open_a_million_cubes_and_answer_one_query)->Unit(benchmark::kMillisecond)->UseRealTime();

void check_every_tile_of_a_million_cubes(benchmark::State& state) {
  Map map = Map::open(map_of_a_million_cubes(), Access::kWrite);
  for (auto _ : state) benchmark::DoNotOptimize(map.cubes().delete_damaged());
}
BENCHMARK(check_every_tile_of_a_million_cubes)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace gdfmap
