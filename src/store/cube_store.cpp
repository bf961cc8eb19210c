#include <algorithm>
#include <limits>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/failpoint.hpp>
#include <gdfmap/store/cube_store.hpp>
#include <gdfmap/store/surroundings.hpp>
#include <gdfmap/store/tile_codec.hpp>

#include "cube_store_verify.hpp"
#include "kCubesSchema.hpp"
#include "tile_row.hpp"

namespace gdfmap {
namespace {

constexpr std::int32_t kApplicationId = 0x47444643;  // "GDFC"
constexpr db::Schema kSchema = {kApplicationId, 2, 0, kCubesSchema};
constexpr char kByKey[] = " WHERE level = ? AND x = ? AND y = ? AND z = ?";
constexpr char kInKeyOrder[] = " ORDER BY level, x, y, z";

/// An open cubes.db whose log is folded in when a writer closes it.
struct Connection {
  Connection(const std::filesystem::path& path, db::OpenMode mode, std::size_t cache_bytes)
      : database(path, mode),
        writes(mode == db::OpenMode::kCreate || mode == db::OpenMode::kWrite) {
    db::prepare_schema(database, kSchema, mode);
    if (writes) {
      db::configure_writer(database, cache_bytes);
    } else {
      database.execute("PRAGMA cache_size = -" + std::to_string(cache_bytes / 1024));
    }
  }
  ~Connection() {
    if (writes) db::close_writer(database);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  db::Database database;
  bool writes;
};

void bind_key(db::Statement& statement, const TileKey& key) {
  statement.bind(key.level, key.x, key.y, key.z);
}

/// Writes tiles within a transaction of its caller.
class TileWriter {
 public:
  explicit TileWriter(db::Database& database)
      : put_row_(database, std::string("INSERT OR REPLACE INTO tiles (id, ") + kStateColumns +
                               ", checksum) VALUES ((SELECT id FROM tiles WHERE level = ?1 AND "
                               "x = ?2 AND y = ?3 AND z = ?4), ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, "
                               "?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18)"),
        put_blob_(database,
                  "INSERT OR REPLACE INTO tile_blobs (tile, surrounding_tiles, data) "
                  "VALUES (?, ?, ?)"),
        database_(database) {}

  void put(const EncodedTile& tile) {
    const TileState& s = tile.state;
    put_row_
        .bind(s.key.level, s.key.x, s.key.y, s.key.z, s.surroundings, s.configuration, s.content,
              encode_mask(s.served), s.num_cubes, s.num_populated, s.num_poor, s.num_failed,
              s.num_gaussians, s.num_measured, s.mean_mae, s.max_mae, s.num_bytes, tile.checksum)
        .run();
    put_blob_.bind(database_.last_insert_id(), tile.surroundings, tile.cubes).run();
  }

 private:
  db::Statement put_row_;
  db::Statement put_blob_;
  db::Database& database_;
};

/// read(), whose errors name the database and the tile.
template <typename Read>
auto naming(const std::string& database, const TileKey& tile, const Read& read) {
  try {
    return read();
  } catch (const Error& error) {
    throw Error(error.code(), database + ": " + tile_name(tile) + ": " + error.what());
  }
}

std::vector<OccupiedTile> in_key_order(std::span<const OccupiedTile> tiles) {
  std::vector<OccupiedTile> sorted(tiles.begin(), tiles.end());
  std::ranges::sort(sorted, {}, &OccupiedTile::key);
  return sorted;
}

}  // namespace

/// Stays in place when the store moves: statements point at their database.
struct CubeStore::Impl {
  Impl(const std::filesystem::path& path, db::OpenMode mode, std::size_t cache_bytes)
      : connection(path, mode, cache_bytes),
        find(database, std::string("SELECT ") + kStateColumns + " FROM tiles" + kByKey),
        read(database, std::string("SELECT ") + kStateColumns + ", " + kTileColumns +
                           " FROM tiles LEFT JOIN tile_blobs ON tile = id" + kByKey) {}

  [[nodiscard]] std::string name() const { return database.path().string(); }

  /// Stores encoded(tile) for each tile, one at a time, in one transaction.
  template <typename Tile, typename Encoded>
  void put(std::span<const Tile> tiles, const Encoded& encoded) {
    db::Transaction transaction(database);
    TileWriter writer(database);
    for (const Tile& tile : tiles) writer.put(encoded(tile));
    failpoint("train.before_commit");
    transaction.commit();
    failpoint("train.after_commit");
  }

  Connection connection;
  db::Database& database = connection.database;
  db::Statement find;
  db::Statement read;
};

CubeStore::CubeStore(const std::filesystem::path& path, db::OpenMode mode, std::size_t cache_bytes)
    : impl_(std::make_unique<Impl>(path, mode, cache_bytes)) {}
CubeStore::~CubeStore() = default;
CubeStore::CubeStore(CubeStore&&) noexcept = default;
CubeStore& CubeStore::operator=(CubeStore&&) noexcept = default;

std::optional<std::string> CubeStore::meta(const std::string& key) {
  db::Statement select(impl_->database, "SELECT value FROM meta WHERE key = ?");
  if (!select.bind(key).step()) return std::nullopt;
  return select.text(0);
}

void CubeStore::set_meta(const std::string& key, const std::string& value) {
  db::Statement(impl_->database, "INSERT OR REPLACE INTO meta (key, value) VALUES (?, ?)")
      .bind(key, value)
      .run();
}

EncodedTile encode(const TileRecord& tile) {
  EncodedTile encoded;
  encoded.cubes = encode_tile(tile);
  encoded.surroundings = encode_surroundings(tile.key, tile.surroundings);
  encoded.checksum = hash64(encoded.cubes);
  encoded.state = summarize(tile, encoded.cubes.size());
  encoded.state.surroundings = hash128(encoded.surroundings);
  return encoded;
}

TileRecord decode(const EncodedTile& tile, const std::string& database) {
  return naming(database, tile.state.key, [&] { return decode(tile); });
}

void CubeStore::put(std::span<const EncodedTile> tiles) {
  impl_->put(tiles, [](const EncodedTile& tile) -> const EncodedTile& { return tile; });
}

void CubeStore::put(std::span<const TileRecord> tiles) { impl_->put(tiles, encode); }

void CubeStore::erase(std::span<const TileKey> tiles) {
  db::Transaction transaction(impl_->database);
  db::Statement erase_blob(
      impl_->database,
      std::string("DELETE FROM tile_blobs WHERE tile = (SELECT id FROM tiles") + kByKey + ")");
  db::Statement erase_row(impl_->database, std::string("DELETE FROM tiles") + kByKey);
  for (const TileKey& key : tiles) {
    for (db::Statement* const statement : {&erase_blob, &erase_row}) {
      bind_key(*statement, key);
      statement->run();
    }
  }
  transaction.commit();
}

void CubeStore::set_occupied(std::span<const OccupiedTile> tiles) {
  const std::vector<OccupiedTile> wanted = in_key_order(tiles);
  try {
    if (wanted == occupied()) return;
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCorrupt) throw;  // a damaged table differs from any other
  }
  db::Transaction transaction(impl_->database);
  impl_->database.execute("DELETE FROM occupied");
  db::Statement insert(impl_->database, "INSERT INTO occupied (x, y, z, mask) VALUES (?, ?, ?, ?)");
  for (const OccupiedTile& tile : wanted) {
    insert.bind(tile.key.x, tile.key.y, tile.key.z, encode_mask(tile.cubes)).run();
  }
  transaction.commit();
}

void CubeStore::for_each_state(const std::function<void(const TileState&)>& visit) {
  db::Statement select(impl_->database,
                       std::string("SELECT ") + kStateColumns + " FROM tiles" + kInKeyOrder);
  while (select.step()) visit(read_state(select, impl_->name()));
}

std::optional<TileState> CubeStore::find_state(const TileKey& key) {
  const db::RewindGuard guard(impl_->find);
  bind_key(impl_->find, key);
  if (!impl_->find.step()) return std::nullopt;
  return read_state(impl_->find, impl_->name());
}

std::optional<EncodedTile> CubeStore::read_encoded(const TileKey& key) {
  db::Statement& row = impl_->read;
  const db::RewindGuard guard(row);
  bind_key(row, key);
  if (!row.step()) return std::nullopt;
  const TileState state = read_state(row, impl_->name());
  return naming(impl_->name(), key, [&] { return read_tile(row, state); });
}

std::optional<TileRecord> CubeStore::read(const TileKey& key) {
  const auto tile = read_encoded(key);
  return tile ? std::optional(decode(*tile, impl_->name())) : std::nullopt;
}

std::vector<OccupiedTile> CubeStore::occupied() {
  db::Statement select(impl_->database, "SELECT x, y, z, mask FROM occupied ORDER BY x, y, z");
  std::vector<OccupiedTile> tiles;
  while (select.step()) {
    const auto coordinate = [&](int column) {
      return read_coordinate(select, column, impl_->name());
    };
    const TileKey key{0, coordinate(0), coordinate(1), coordinate(2)};
    tiles.push_back({key, decode_mask(select.blob(3), impl_->name() + ": " + tile_name(key))});
  }
  return tiles;
}

CubeTotals CubeStore::totals() {
  db::Statement select(impl_->database,
                       "SELECT count(*), sum(num_cubes), sum(num_populated), sum(num_poor), "
                       "sum(num_failed), sum(num_gaussians), sum(num_measured), sum(num_bytes), "
                       "sum(mean_mae * num_measured) FROM tiles");
  select.step();
  CubeTotals totals;
  totals.num_tiles = select.integer(0);
  totals.num_cubes = select.integer(1);
  totals.num_populated = select.integer(2);
  totals.num_poor = select.integer(3);
  totals.num_failed = select.integer(4);
  totals.num_gaussians = select.integer(5);
  totals.num_measured = select.integer(6);
  totals.num_bytes = select.integer(7);
  if (totals.num_measured > 0) {
    totals.mean_mae = select.real(8) / static_cast<double>(totals.num_measured);
  }
  return totals;
}

bool CubeStore::has_cubes() {
  return impl_->database.query_int("SELECT EXISTS (SELECT 1 FROM tiles WHERE num_cubes > 0)") != 0;
}

Digest CubeStore::content_digest() {
  db::Statement select(impl_->database,
                       std::string("SELECT content FROM tiles WHERE num_cubes > 0") + kInKeyOrder);
  StreamHasher hasher;
  while (select.step()) {
    ByteWriter writer;
    writer.put(select.digest(0));
    hasher.update(writer.bytes());
  }
  return hasher.digest();
}

std::vector<std::string> CubeStore::delete_damaged(const RunContext& context) {
  return delete_damaged_tiles(impl_->database, context);
}

std::vector<std::string> CubeStore::verify(bool checksums, const RunContext& context) {
  return verify_store(impl_->database, checksums, context);
}

}  // namespace gdfmap
