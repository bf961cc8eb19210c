#include <algorithm>

#include <gdfmap/core/failpoint.hpp>

#include "point_store_impl.hpp"

namespace gdfmap {
namespace {

/// Blocks (and tiles) deleted in one transaction.
constexpr std::int64_t kRowsPerTransaction = 4096;
/// Pages that one transaction gives back to the file system.
constexpr int kPagesPerTransaction = 4096;

/// Deletes the rows of an unpublished source, tile by tile, in bounded transactions.
class SourceDeleter {
 public:
  SourceDeleter(db::Database& database, std::int64_t source, const RunContext& context)
      : database_(&database),
        source_(source),
        context_(&context),
        next_tile_(database, "SELECT tile FROM tile_sources WHERE source = ? LIMIT 1"),
        delete_blocks_(database,
                       "DELETE FROM blocks WHERE id IN (SELECT id FROM blocks WHERE tile = ? AND "
                       "source = ? LIMIT " +
                           std::to_string(kRowsPerTransaction) + ")"),
        delete_summary_(database, "DELETE FROM tile_sources WHERE tile = ? AND source = ?"),
        delete_tile_(database,
                     "DELETE FROM tiles WHERE id = ?1 AND NOT EXISTS (SELECT 1 FROM tile_sources "
                     "WHERE tile = ?1)") {}

  void run() {
    while (delete_some()) {
      if (context_->stop_requested()) return;
    }
    db::Statement delete_source(*database_, "DELETE FROM sources WHERE id = ?");
    delete_source.bind(source_).run();
  }

 private:
  /// One transaction; false when nothing was left.
  bool delete_some() {
    db::Transaction transaction(*database_);
    std::int64_t num_rows = 0;
    bool more = true;
    while (more && num_rows < kRowsPerTransaction) {
      more = next_tile_.bind(source_).step();
      const std::int64_t tile = more ? next_tile_.integer(0) : 0;
      next_tile_.rewind();
      if (more) num_rows += delete_from_tile(tile);
    }
    failpoint("discard.before_commit");
    transaction.commit();
    failpoint("discard.after_commit");
    return more;
  }

  std::int64_t delete_from_tile(std::int64_t tile) {
    delete_blocks_.bind(tile, source_).run();
    const std::int64_t num_blocks = database_->changes();
    if (num_blocks == kRowsPerTransaction) return num_blocks;  // there may be more
    delete_summary_.bind(tile, source_).run();
    delete_tile_.bind(tile).run();
    return num_blocks + 1;
  }

  db::Database* database_;
  std::int64_t source_;
  const RunContext* context_;
  db::Statement next_tile_, delete_blocks_, delete_summary_, delete_tile_;
};

/// kSummaryColumns as the row that was to be inserted has them.
std::string excluded_columns() {
  std::string columns = std::string("excluded.") + kSummaryColumns;
  for (std::size_t at = columns.find(", "); at != std::string::npos;
       at = columns.find(", ", at + 2)) {
    columns.insert(at + 2, "excluded.");
  }
  return columns;
}

[[noreturn]] void throw_no_source(const db::Database& database, std::int64_t source) {
  throw Error(ErrorCode::kUsage,
              database.path().string() + ": there is no source " + std::to_string(source));
}

/// Makes a source invisible. @throws Error kUsage unless it is published.
void hide(db::Database& database, std::int64_t source) {
  db::Statement update(database, "UPDATE sources SET published = 0 WHERE id = ? AND published = 1");
  update.bind(source).run();
  if (database.changes() != 1) throw_no_source(database, source);
}

/// Makes a source visible. @throws Error kUsage unless it was begun and is not published.
void show(db::Database& database, const SourceRecord& source) {
  const IngestCounts& counts = source.counts;
  db::Statement update(
      database,
      "UPDATE sources SET identity = ?, num_bytes = ?, num_read = ?, num_stored = ?, "
      "num_duplicates = ?, num_thinned = ?, num_rejected_not_finite = ?, "
      "num_rejected_withheld = ?, num_rejected_zero = ?, num_rejected_out_of_range = ?, "
      "num_rejected_outside = ?, sensor_x = ?, sensor_y = ?, sensor_z = ?, alignment = ?, "
      "published = 1 WHERE id = ? AND published = 0");
  const auto sensor = [&](int axis) {
    return source.sensor_origin ? std::optional((*source.sensor_origin)[axis]) : std::nullopt;
  };
  update
      .bind(source.identity, source.num_bytes, counts.num_read, counts.num_stored,
            counts.num_duplicates, counts.num_thinned, counts.num_rejected_not_finite,
            counts.num_rejected_withheld, counts.num_rejected_zero,
            counts.num_rejected_out_of_range, counts.num_rejected_outside, sensor(0), sensor(1),
            sensor(2), source.alignment, source.id)
      .run();
  if (database.changes() != 1) {
    throw Error(ErrorCode::kUsage, database.path().string() + ": source " +
                                       std::to_string(source.id) + " cannot be published");
  }
}

}  // namespace

FullSync::FullSync(db::Database& database) : database_(&database) {
  database.execute("PRAGMA synchronous = FULL");
}

FullSync::~FullSync() {
  try {
    database_->execute("PRAGMA synchronous = NORMAL");
  } catch (const std::exception&) {
    // Stays FULL: slower, and no less right.
  }
}

void delete_unpublished(db::Database& database, const RunContext& context,
                        std::span<const std::int64_t> kept) {
  std::vector<std::int64_t> ids;
  db::Statement select(database, "SELECT id FROM sources WHERE published = 0");
  while (select.step()) {
    const std::int64_t id = select.integer(0);
    if (std::ranges::find(kept, id) == kept.end()) ids.push_back(id);
  }
  for (const std::int64_t id : ids) SourceDeleter(database, id, context).run();
}

void give_back_free_pages(db::Database& database, const RunContext& context) {
  while (!context.stop_requested() && database.query_int("PRAGMA freelist_count") > 0) {
    database.execute("PRAGMA incremental_vacuum(" + std::to_string(kPagesPerTransaction) + ")");
  }
}

void TileSummary::add(const NewBlock& block) {
  digest += block.digest;
  num_points += block.num_points;
  num_blocks += 1;
  block_bytes += block.data.size();
  cubes |= block.cubes;
}

BlockInserter::BlockInserter(db::Database& database)
    : database_(&database),
      select_tile_(database, "SELECT id FROM tiles WHERE x = ? AND y = ? AND z = ?"),
      insert_tile_(database, "INSERT INTO tiles (x, y, z) VALUES (?, ?, ?)"),
      select_summary_(database, std::string("SELECT ") + kSummaryColumns +
                                    " FROM tile_sources WHERE tile = ? AND source = ?"),
      // Not REPLACE, which would write the entry of tile_sources_by_source again.
      put_summary_(database, std::string("INSERT INTO tile_sources (tile, source, ") +
                                 kSummaryColumns +
                                 ") VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) "
                                 "ON CONFLICT DO UPDATE SET (" +
                                 kSummaryColumns + ") = (" + excluded_columns() + ")"),
      insert_block_(database,
                    "INSERT INTO blocks (tile, source, sequence, num_points, checksum, data) "
                    "VALUES (?, ?, ?, ?, ?, ?)") {}

std::int64_t BlockInserter::tile_id(const TileKey& key) {
  const db::RewindGuard guard(select_tile_);
  if (select_tile_.bind(key.x, key.y, key.z).step()) return select_tile_.integer(0);
  insert_tile_.bind(key.x, key.y, key.z).run();
  return database_->last_insert_id();
}

TileSummary BlockInserter::summary(std::int64_t tile, std::int64_t source) {
  const db::RewindGuard guard(select_summary_);
  if (!select_summary_.bind(tile, source).step()) return {};
  return read_summary(select_summary_, 0);
}

void BlockInserter::put_summary(std::int64_t tile, std::int64_t source, const TileSummary& s) {
  const auto& cubes = s.cubes.words();
  put_summary_
      .bind(tile, source, s.digest.low, s.digest.high, s.num_points, s.num_blocks, s.block_bytes,
            cubes[0], cubes[1], cubes[2], cubes[3], cubes[4], cubes[5], cubes[6], cubes[7])
      .run();
}

void BlockInserter::insert(std::int64_t source, const NewBlock& block) {
  const std::int64_t tile = tile_id(block.tile);
  TileSummary sums = summary(tile, source);
  insert_block_
      .bind(tile, source, sums.num_blocks, block.num_points, hash64(block.data), block.data)
      .run();
  sums.add(block);
  put_summary(tile, source, sums);
}

void PointStore::set_meta(const std::string& key, const std::string& value) {
  db::Statement put(impl_->database, "REPLACE INTO meta (key, value) VALUES (?, ?)");
  put.bind(key, value).run();
}

std::int64_t PointStore::begin_source(const std::string& path, const std::string& parameters,
                                      int voxel_steps) {
  delete_unpublished(impl_->database, {}, impl_->staged);
  db::Statement insert(impl_->database,
                       "INSERT INTO sources (path, parameters, voxel_steps) VALUES (?, ?, ?)");
  insert.bind(path, parameters, voxel_steps).run();
  return impl_->staged.emplace_back(impl_->database.last_insert_id());
}

void PointStore::append(std::int64_t source, std::span<const NewBlock> blocks) {
  if (!impl_->inserter) impl_->inserter.emplace(impl_->database);
  db::Transaction transaction(impl_->database);
  for (const NewBlock& block : blocks) impl_->inserter->insert(source, block);
  failpoint("ingest.before_append");
  transaction.commit();
  failpoint("ingest.after_append");
}

void PointStore::publish(std::span<const SourceRecord> sources,
                         std::optional<std::int64_t> replaced) {
  for (const SourceRecord& source : sources) {
    if (!find_source(source.identity)) continue;
    throw Error(ErrorCode::kUsage,
                impl_->database.path().string() + ": " + source.path + " is published already");
  }
  const FullSync full_sync(impl_->database);
  db::Transaction transaction(impl_->database);
  if (replaced) hide(impl_->database, *replaced);
  for (const SourceRecord& source : sources) show(impl_->database, source);
  failpoint("ingest.before_publish");
  transaction.commit();
  failpoint("ingest.after_publish");
  for (const SourceRecord& source : sources) std::erase(impl_->staged, source.id);
}

void PointStore::discard(std::int64_t source, const RunContext& context) {
  db::Statement is_published(impl_->database,
                             "SELECT 1 FROM sources WHERE id = ? AND published = 1");
  if (is_published.bind(source).step()) return;
  is_published.rewind();
  std::erase(impl_->staged, source);
  SourceDeleter(impl_->database, source, context).run();
  give_back_free_pages(impl_->database, context);
}

void PointStore::set_sensor_origin(std::int64_t source, const Vector3& p_map) {
  const FullSync full_sync(impl_->database);
  db::Transaction transaction(impl_->database);
  db::Statement update(impl_->database,
                       "UPDATE sources SET sensor_x = ?, sensor_y = ?, sensor_z = ? "
                       "WHERE id = ? AND published = 1");
  update.bind(p_map.x(), p_map.y(), p_map.z(), source).run();
  if (impl_->database.changes() != 1) throw_no_source(impl_->database, source);
  transaction.commit();
}

void PointStore::remove(std::int64_t source, const RunContext& context) {
  {
    const FullSync full_sync(impl_->database);
    db::Transaction transaction(impl_->database);
    hide(impl_->database, source);
    failpoint("remove.before_commit");
    transaction.commit();
    failpoint("remove.after_commit");
  }
  discard(source, context);
}

}  // namespace gdfmap
