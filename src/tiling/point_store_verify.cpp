#include "point_store_impl.hpp"

namespace gdfmap {
namespace {

/// Faults found by queries whose every row is the text of one.
constexpr const char* kCountChecks[] = {
    "SELECT 'source ' || id || ' (' || path || '): its counts do not add up' FROM sources "
    "WHERE published = 1 AND num_read <> num_stored + num_duplicates + num_thinned + "
    "num_rejected_not_finite + num_rejected_withheld + num_rejected_zero + "
    "num_rejected_out_of_range + num_rejected_outside",

    "SELECT 'source ' || id || ' (' || path || '): its tiles do not hold its number of points' "
    "FROM sources WHERE published = 1 AND num_stored <> "
    "(SELECT total(num_points) FROM tile_sources WHERE source = sources.id)",

    "SELECT 'tile ' || tile || ', source ' || source || ': its blocks do not match its counts' "
    "FROM tile_sources t WHERE source IN (SELECT id FROM sources WHERE published = 1) AND "
    "(num_blocks, num_points, block_bytes) <> (SELECT count(*), "
    "ifnull(sum(num_points), 0), ifnull(sum(length(data)), 0) FROM blocks b "
    "WHERE b.tile = t.tile AND b.source = t.source)",

    "SELECT 'block ' || id || ': belongs to no tile' FROM blocks b WHERE NOT EXISTS "
    "(SELECT 1 FROM tile_sources t WHERE t.tile = b.tile AND t.source = b.source)",

    "SELECT 'tile ' || tile || ', source ' || source || ': the tile or the source is missing' "
    "FROM tile_sources WHERE tile NOT IN (SELECT id FROM tiles) "
    "OR source NOT IN (SELECT id FROM sources)"};

void check_blocks(db::Database& database, std::vector<std::string>& faults) {
  db::Statement select(database,
                       "SELECT b.id, s.path, b.num_points, b.checksum, b.data FROM blocks b "
                       "JOIN sources s ON s.id = b.source WHERE s.published = 1 ORDER BY b.id");
  while (select.step()) {
    const auto report = [&](const std::string& fault) {
      faults.push_back("block " + std::to_string(select.integer(0)) + " of " + select.text(1) +
                       ": " + fault);
    };
    if (hash64(select.blob(4)) != static_cast<std::uint64_t>(select.integer(3))) {
      report("its checksum does not match");
      continue;
    }
    try {
      const std::size_t num_points = decode_block(select.blob(4)).size();
      if (num_points != static_cast<std::uint64_t>(select.integer(2))) {
        report("its number of points does not match");
      }
    } catch (const Error& error) {
      report(error.what());
    }
  }
}

void add_rows(db::Database& database, const std::string& sql, std::vector<std::string>& faults) {
  db::Statement select(database, sql);
  while (select.step()) faults.push_back(select.text(0));
}

}  // namespace

std::vector<std::string> PointStore::verify(bool checksums) {
  db::Database& database = impl_->database;
  std::vector<std::string> faults;
  try {
    add_rows(database, "PRAGMA integrity_check", faults);
    if (faults == std::vector<std::string>{"ok"}) faults.clear();
    for (const char* const sql : kCountChecks) add_rows(database, sql, faults);
    if (checksums) check_blocks(database, faults);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCorrupt) throw;
    faults.push_back(error.what());
  }
  return faults;
}

}  // namespace gdfmap
