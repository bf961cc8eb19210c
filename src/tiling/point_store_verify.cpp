#include <gdfmap/db/verification.hpp>

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

    "SELECT 'tile ' || id || ': no source has points in it' FROM tiles "
    "WHERE id NOT IN (SELECT tile FROM tile_sources)",

    "SELECT 'tile ' || tile || ', source ' || source || ': the tile or the source is missing' "
    "FROM tile_sources WHERE tile NOT IN (SELECT id FROM tiles) "
    "OR source NOT IN (SELECT id FROM sources)"};

/// Every published block, in the order in which they lie in the file.
class BlockChecker {
 public:
  BlockChecker(db::Database& database, db::Verification& verification, const RunContext& context)
      : database_(database),
        verification_(verification),
        context_(context),
        select_summary_(database, std::string("SELECT ") + kSummaryColumns +
                                      " FROM tile_sources WHERE tile = ? AND source = ?") {}

  void run() {
    const auto num_blocks = static_cast<std::uint64_t>(database_.query_int(
        "SELECT count(*) FROM blocks WHERE source IN (SELECT id FROM sources WHERE published)"));
    db::Statement select(database_, std::string("SELECT ") + kBlockColumns +
                                        ", b.tile, b.source FROM blocks b "
                                        "JOIN sources s ON s.id = b.source "
                                        "JOIN tiles t ON t.id = b.tile "
                                        "WHERE s.published = 1 ORDER BY b.id");
    std::uint64_t num_checked = 0;
    while (select.step()) {
      if (num_checked++ % kBlocksPerReport == 0) {
        context_.throw_if_stopped();
        context_.progress({"blocks checked", num_checked - 1, num_blocks, ""});
      }
      verification_.run([&] { check(select); });
    }
    context_.progress({"blocks checked", num_checked, num_blocks, ""});
  }

 private:
  static constexpr std::uint64_t kBlocksPerReport = 64;

  void check(const db::Statement& row) {
    const std::vector<TileOffset> points = read_block(row);
    const db::RewindGuard guard(select_summary_);
    select_summary_.bind(row.integer(kNumBlockColumns), row.integer(kNumBlockColumns + 1));
    if (!select_summary_.step()) return;  // belongs to no tile: told already
    const CubeMask listed = read_summary(select_summary_, 0).cubes;
    for (const TileOffset& point : points) {
      if (listed.test(point.cube())) continue;
      throw Error(ErrorCode::kCorrupt,
                  block_name(row) + " has points in cubes that its tile does not list");
    }
  }

  db::Database& database_;
  db::Verification& verification_;
  const RunContext& context_;
  db::Statement select_summary_;
};

}  // namespace

std::vector<std::string> PointStore::verify(bool checksums, const RunContext& context) {
  db::Verification verification(impl_->database);
  verification.check_file(!checksums);
  context.throw_if_stopped();
  for (const char* const sql : kCountChecks) verification.check_none(sql);
  if (checksums) {
    verification.run([&] { BlockChecker(impl_->database, verification, context).run(); });
  }
  return verification.take_faults();
}

}  // namespace gdfmap
