#include <algorithm>

#include <gdfmap/core/error.hpp>
#include <gdfmap/tiling/point_store.hpp>

#include "block_merge.hpp"
#include "kPointsSchema.hpp"
#include "point_store_impl.hpp"

namespace gdfmap {
namespace {

constexpr const char* kMigrations[] = {
    "ALTER TABLE sources ADD COLUMN sensor_x REAL;"
    "ALTER TABLE sources ADD COLUMN sensor_y REAL;"
    "ALTER TABLE sources ADD COLUMN sensor_z REAL;"
    "ALTER TABLE sources ADD COLUMN alignment TEXT NOT NULL DEFAULT ''"};
/// Since when sources have sensors.
constexpr int kMinorWithSensors = 1;

constexpr db::Schema kSchema{.application_id = 0x67646670,  // "gdfp"
                             .major = 2,
                             .minor = 1,
                             .sql = kPointsSchema,
                             .migrations = kMigrations};

/// What one published source has in one tile, after x, y and z of the tile, voxels and source.
std::string tile_query(const char* rest) {
  // CROSS JOIN keeps the tiles in the outer loop, which then runs along their keys.
  return std::string("SELECT t.x, t.y, t.z, s.voxel_steps, s.id, ") + kSummaryColumns +
         " FROM tiles t CROSS JOIN tile_sources ON tile = t.id JOIN sources s ON s.id = source"
         " WHERE s.published = 1 " +
         rest;
}

const std::string kBlocksOfTileQuery =
    std::string("SELECT ") + kBlockColumns +
    ", s.voxel_steps FROM tiles t JOIN blocks b ON b.tile = t.id JOIN sources s ON s.id = b.source"
    " WHERE t.x = ? AND t.y = ? AND t.z = ? AND s.published = 1 ORDER BY b.source, b.sequence";

TileKey read_tile_key(const db::Statement& row) {
  return {0, static_cast<std::int32_t>(row.integer(0)), static_cast<std::int32_t>(row.integer(1)),
          static_cast<std::int32_t>(row.integer(2))};
}

/// Of a share of a tile, from a row of tile_query() and its summary.
Digest share_digest(const db::Statement& row, const TileSummary& summary) {
  ByteWriter hashed;
  hashed.put(summary.digest);
  hashed.put(row.integer(3));
  return hash128(hashed.bytes());
}

/// Adds what one source has in a tile, a row of tile_query().
void add_source(const db::Statement& row, TilePoints& tile) {
  const TileSummary summary = read_summary(row, 5);
  tile.digest += share_digest(row, summary);
  tile.cubes |= summary.cubes;
  tile.num_points += summary.num_points;
}

SourceRecord read_source(const db::Statement& row) {
  const auto count = [&](int column) { return static_cast<std::uint64_t>(row.integer(column)); };
  SourceRecord source;
  source.id = row.integer(0);
  source.path = row.text(1);
  source.parameters = row.text(2);
  source.identity = row.digest(3);
  source.num_bytes = count(4);
  source.counts = {.num_read = count(5),
                   .num_stored = count(6),
                   .num_duplicates = count(7),
                   .num_thinned = count(8),
                   .num_rejected_not_finite = count(9),
                   .num_rejected_withheld = count(10),
                   .num_rejected_zero = count(11),
                   .num_rejected_out_of_range = count(12),
                   .num_rejected_outside = count(13)};
  source.voxel_steps = static_cast<int>(row.integer(14));
  if (!row.is_null(15) && !row.is_null(16) && !row.is_null(17)) {
    source.sensor_origin = Vector3(row.real(15), row.real(16), row.real(17));
  }
  source.alignment = row.text(18);
  return source;
}

std::string source_query(bool knows_sensors, const char* rest) {
  return std::string(
             "SELECT id, path, parameters, identity, num_bytes, num_read, num_stored,"
             " num_duplicates, num_thinned, num_rejected_not_finite, num_rejected_withheld,"
             " num_rejected_zero, num_rejected_out_of_range, num_rejected_outside, voxel_steps,") +
         (knows_sensors ? " sensor_x, sensor_y, sensor_z, alignment" : " NULL, NULL, NULL, ''") +
         " FROM sources WHERE published = 1" + rest;
}

std::vector<TileOffset> checked_points(std::span<const std::byte> data, std::int64_t checksum,
                                       std::int64_t num_points) {
  if (hash64(data) != static_cast<std::uint64_t>(checksum)) {
    throw Error(ErrorCode::kCorrupt, "its checksum does not match");
  }
  std::vector<TileOffset> points = decode_block(data);
  if (points.size() != static_cast<std::uint64_t>(num_points)) {
    throw Error(ErrorCode::kCorrupt, "its number of points does not match");
  }
  return points;
}

/// How finely a source was thinned, and how many points all such sources have in a tile.
struct VoxelSize {
  int steps;
  std::uint64_t num_points;
};

/// A source may come from a damaged file.
int checked_voxel_steps(std::int64_t steps) {
  if (steps < 0 || steps > kStepsPerCubeAxis) {
    throw Error(ErrorCode::kCorrupt, "its source has impossible voxels");
  }
  return static_cast<int>(steps);
}

void add_points(std::vector<VoxelSize>& sizes, int steps, std::uint64_t num_points) {
  const auto known = std::find_if(sizes.begin(), sizes.end(),
                                  [&](const VoxelSize& size) { return size.steps == steps; });
  if (known == sizes.end()) {
    sizes.push_back({steps, num_points});
  } else {
    known->num_points += num_points;
  }
}

}  // namespace

std::string block_name(const db::Statement& row) {
  return "tile (" + row.text(0) + ", " + row.text(1) + ", " + row.text(2) + "), block " +
         row.text(3) + " of source " + row.text(4) + " (" + row.text(5) + ")";
}

std::vector<TileOffset> read_block(const db::Statement& row) {
  try {
    return checked_points(row.blob(8), row.integer(7), row.integer(6));
  } catch (const Error& error) {
    throw Error(ErrorCode::kCorrupt, block_name(row) + " is damaged: " + error.what());
  }
}

std::vector<TileOffset> read_block(const db::Statement& row, const std::filesystem::path& path) {
  try {
    return read_block(row);
  } catch (const Error& error) {
    throw Error(error.code(), path.string() + ": " + error.what());
  }
}

IngestCounts& IngestCounts::operator+=(const IngestCounts& other) {
  num_read += other.num_read;
  num_stored += other.num_stored;
  num_duplicates += other.num_duplicates;
  num_thinned += other.num_thinned;
  num_rejected_not_finite += other.num_rejected_not_finite;
  num_rejected_withheld += other.num_rejected_withheld;
  num_rejected_zero += other.num_rejected_zero;
  num_rejected_out_of_range += other.num_rejected_out_of_range;
  num_rejected_outside += other.num_rejected_outside;
  return *this;
}

TileSummary read_summary(const db::Statement& row, int first_column) {
  const auto number = [&](int column) {
    return static_cast<std::uint64_t>(row.integer(first_column + column));
  };
  TileSummary summary{.digest = {number(0), number(1)},
                      .num_points = number(2),
                      .num_blocks = number(3),
                      .block_bytes = number(4),
                      .cubes = {}};
  int column = 5;
  for (std::uint64_t& word : summary.cubes.words()) word = number(column++);
  return summary;
}

PointStore::Impl::Impl(const std::filesystem::path& path, db::OpenMode mode,
                       std::size_t cache_bytes)
    : database(path, mode), writes(mode == db::OpenMode::kCreate || mode == db::OpenMode::kWrite) {
  knows_sensors = db::prepare_schema(database, kSchema, mode) >= kMinorWithSensors;
  if (writes) db::configure_writer(database, cache_bytes);
  select_tile.emplace(database, tile_query("AND t.x = ? AND t.y = ? AND t.z = ?"));
  select_blocks.emplace(database, kBlocksOfTileQuery);
}

PointStore::Impl::~Impl() {
  inserter.reset();
  select_tile.reset();
  select_blocks.reset();
  if (writes) db::close_writer(database);
}

PointStore::PointStore(const std::filesystem::path& path, db::OpenMode mode,
                       std::size_t cache_bytes)
    : impl_(std::make_unique<Impl>(path, mode, cache_bytes)) {}

PointStore::~PointStore() = default;
PointStore::PointStore(PointStore&&) noexcept = default;
PointStore& PointStore::operator=(PointStore&&) noexcept = default;

const std::filesystem::path& PointStore::path() const { return impl_->database.path(); }

std::optional<std::string> PointStore::meta(const std::string& key) {
  db::Statement select(impl_->database, "SELECT value FROM meta WHERE key = ?");
  if (!select.bind(key).step()) return std::nullopt;
  return select.text(0);
}

std::vector<SourceRecord> PointStore::sources() {
  std::vector<SourceRecord> result;
  db::Statement select(impl_->database, source_query(impl_->knows_sensors, " ORDER BY id"));
  while (select.step()) result.push_back(read_source(select));
  return result;
}

std::optional<SourceRecord> PointStore::find_source(const Digest& identity) {
  db::Statement select(impl_->database, source_query(impl_->knows_sensors, " AND identity = ?"));
  if (!select.bind(identity).step()) return std::nullopt;
  return read_source(select);
}

bool PointStore::has_source_of_size(std::uint64_t num_bytes) {
  db::Statement select(impl_->database,
                       "SELECT 1 FROM sources WHERE published = 1 AND num_bytes = ?");
  return select.bind(num_bytes).step();
}

void PointStore::for_each_tile(const std::function<void(const TilePoints&)>& visit) {
  db::Statement select(impl_->database, tile_query("ORDER BY t.x, t.y, t.z"));
  std::optional<TilePoints> tile;
  while (select.step()) {
    const TileKey key = read_tile_key(select);
    if (tile && tile->key != key) visit(*tile);
    if (!tile || tile->key != key) tile = TilePoints{.key = key, .cubes = {}, .digest = {}};
    add_source(select, *tile);
  }
  if (tile) visit(*tile);
}

std::optional<TilePoints> PointStore::find_tile(const TileKey& key) {
  db::Statement& select = *impl_->select_tile;
  const db::RewindGuard guard(select);
  std::optional<TilePoints> tile;
  for (select.bind(key.x, key.y, key.z); select.step();) {
    if (!tile) tile = TilePoints{.key = key, .cubes = {}, .digest = {}};
    add_source(select, *tile);
  }
  return tile;
}

std::vector<SourceShare> PointStore::shares(const TileKey& key) {
  db::Statement& select = *impl_->select_tile;
  const db::RewindGuard guard(select);
  std::vector<SourceShare> shares;
  for (select.bind(key.x, key.y, key.z); select.step();) {
    const TileSummary summary = read_summary(select, 5);
    shares.push_back({select.integer(4), share_digest(select, summary), summary.cubes});
  }
  std::ranges::sort(shares, {}, &SourceShare::source);
  return shares;
}

void PointStore::for_each_block(const TileKey& key,
                                const std::function<void(std::span<const TileOffset>)>& visit) {
  db::Statement& select = *impl_->select_blocks;
  const db::RewindGuard guard(select);
  const auto voxel_steps = [&] { return checked_voxel_steps(select.integer(kNumBlockColumns)); };
  std::vector<VoxelSize> sizes;
  for (select.bind(key.x, key.y, key.z); select.step();) {
    if (voxel_steps() == 0) {
      visit(read_block(select, impl_->database.path()));
    } else {
      add_points(sizes, voxel_steps(), static_cast<std::uint64_t>(select.integer(6)));
    }
  }
  for (const VoxelSize& size : sizes) {
    const BlockScan scan = [&](const VisitPoints& visit_block) {
      for (select.bind(key.x, key.y, key.z); select.step();) {
        if (voxel_steps() != size.steps) continue;
        visit_block(read_block(select, impl_->database.path()));
      }
    };
    merge_blocks(scan, size.num_points, size.steps, visit);
  }
}

PointStore::Totals PointStore::totals() {
  db::Statement select(impl_->database,
                       "SELECT count(DISTINCT tile), sum(num_points), sum(num_blocks), "
                       "sum(block_bytes) FROM tile_sources "
                       "WHERE source IN (SELECT id FROM sources WHERE published = 1)");
  select.step();
  const auto number = [&](int column) {
    return static_cast<std::uint64_t>(select.integer(column));
  };
  return {.num_points = number(1),
          .num_blocks = number(2),
          .num_tiles = number(0),
          .block_bytes = number(3)};
}

}  // namespace gdfmap
