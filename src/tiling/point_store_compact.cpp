#include <algorithm>
#include <filesystem>
#include <optional>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/failpoint.hpp>
#include <gdfmap/core/morton.hpp>

#include "block_merge.hpp"
#include "point_store_impl.hpp"

namespace gdfmap {
namespace {

/// Blocks rewritten in one transaction, in bytes of the new ones.
constexpr std::size_t kBytesPerTransaction = std::size_t{4} << 20;

/// What one source has in one tile, as several blocks.
struct Part {
  std::int64_t tile = 0, source = 0;
  std::uint64_t num_points = 0, num_blocks = 0;
  int voxel_steps = 0;
};

/// The blocks that take the place of a part's.
struct MergedPart {
  struct Block {
    std::uint32_t num_points = 0;
    Bytes data;
  };
  std::vector<Block> blocks;
  std::uint64_t num_points = 0, num_bytes = 0;
  MergeCounts counts;
};

/// Cuts points that come in order into full blocks and a last one.
class BlockCutter {
 public:
  explicit BlockCutter(MergedPart& merged) : merged_(&merged) {}

  void add(std::span<const TileOffset> points) {
    while (!points.empty()) {
      const auto room = std::min(points.size(), kMaxBlockPoints - waiting_.size());
      waiting_.insert(waiting_.end(), points.begin(),
                      points.begin() + static_cast<std::ptrdiff_t>(room));
      points = points.subspan(room);
      if (waiting_.size() == kMaxBlockPoints) cut();
    }
  }
  void finish() {
    if (!waiting_.empty()) cut();
  }

 private:
  void cut() {
    Bytes data = encode_block(waiting_);
    merged_->num_points += waiting_.size();
    merged_->num_bytes += data.size();
    merged_->blocks.push_back({static_cast<std::uint32_t>(waiting_.size()), std::move(data)});
    waiting_.clear();
  }

  MergedPart* merged_;
  std::vector<TileOffset> waiting_;
};

std::uint64_t code_of(const TileOffset& p) { return morton_code(p.x, p.y, p.z); }

class Compactor {
 public:
  Compactor(db::Database& database, const RunContext& context)
      : database_(&database),
        context_(&context),
        next_part_(database,
                   "SELECT p.tile, p.source, p.num_points, p.num_blocks, "
                   "s.voxel_steps FROM tile_sources p JOIN sources s ON s.id = p.source WHERE "
                   "(p.tile, p.source) > (?, ?) AND "
                   "p.num_blocks > 1 AND s.published = 1 ORDER BY p.tile, p.source LIMIT 1"),
        select_blocks_(database, std::string("SELECT ") + kBlockColumns +
                                     " FROM blocks b JOIN sources s ON s.id = b.source "
                                     "JOIN tiles t ON t.id = b.tile "
                                     "WHERE b.tile = ? AND b.source = ? ORDER BY b.sequence"),
        delete_blocks_(database, "DELETE FROM blocks WHERE tile = ? AND source = ?"),
        insert_block_(database,
                      "INSERT INTO blocks (tile, source, sequence, num_points, checksum, data) "
                      "VALUES (?, ?, ?, ?, ?, ?)"),
        update_summary_(database,
                        "UPDATE tile_sources SET num_points = ?, num_blocks = ?, block_bytes = ? "
                        "WHERE tile = ? AND source = ?"),
        update_source_(database,
                       "UPDATE sources SET num_stored = num_stored - ?1 - ?2, "
                       "num_duplicates = num_duplicates + ?1, num_thinned = num_thinned + ?2 "
                       "WHERE id = ?3") {}

  /// Returns how many parts were merged.
  std::uint64_t run() {
    num_parts_ = static_cast<std::uint64_t>(
        database_->query_int("SELECT count(*) FROM tile_sources WHERE num_blocks > 1 AND source IN "
                             "(SELECT id FROM sources WHERE published = 1)"));
    bool more = true;
    while (more) {
      context_->throw_if_stopped();
      more = merge_some();
    }
    return num_merged_;
  }

 private:
  /// One transaction; false when nothing was left.
  bool merge_some() {
    db::Transaction transaction(*database_);
    std::uint64_t num_bytes = 0;
    std::optional<Part> part;
    while (num_bytes < kBytesPerTransaction && !context_->stop_requested() &&
           (part = next_part())) {
      num_bytes += merge(*part);
      last_tile_ = part->tile;
      last_source_ = part->source;
      context_->progress(
          {.stage = "tiles", .done = ++num_done_, .total = num_parts_, .detail = {}});
    }
    failpoint("compact.before_commit");
    transaction.commit();
    failpoint("compact.after_commit");
    return num_bytes >= kBytesPerTransaction || context_->stop_requested();
  }

  std::optional<Part> next_part() {
    const db::RewindGuard guard(next_part_);
    if (!next_part_.bind(last_tile_, last_source_).step()) return std::nullopt;
    const auto number = [&](int column) { return next_part_.integer(column); };
    return Part{.tile = number(0),
                .source = number(1),
                .num_points = static_cast<std::uint64_t>(number(2)),
                .num_blocks = static_cast<std::uint64_t>(number(3)),
                .voxel_steps = static_cast<int>(number(4))};
  }

  /// Returns the bytes that were written.
  std::uint64_t merge(const Part& part) {
    const BlockScan scan = [&](const VisitPoints& visit) {
      const db::RewindGuard guard(select_blocks_);
      for (select_blocks_.bind(part.tile, part.source); select_blocks_.step();) {
        visit(read_block(select_blocks_, database_->path()));
      }
    };
    if (is_merged(part, scan)) return 0;
    MergedPart merged;
    BlockCutter cutter(merged);
    merged.counts = merge_blocks(scan, part.num_points, part.voxel_steps,
                                 [&](std::span<const TileOffset> points) { cutter.add(points); });
    cutter.finish();
    replace(part, merged);
    ++num_merged_;
    return merged.num_bytes;
  }

  /// Whether the blocks are those that merging them would make: in order, and full but the last.
  bool is_merged(const Part& part, const BlockScan& scan) const {
    if (part.num_blocks > (part.num_points + kMaxBlockPoints - 1) / kMaxBlockPoints) return false;
    bool merged = true;
    std::optional<std::uint64_t> last;
    scan([&](std::span<const TileOffset> points) {
      merged &= !last || *last < code_of(points.front());
      last = code_of(points.back());
    });
    return merged;
  }

  void replace(const Part& part, const MergedPart& merged) {
    delete_blocks_.bind(part.tile, part.source).run();
    std::int64_t sequence = 0;
    for (const MergedPart::Block& block : merged.blocks) {
      insert_block_
          .bind(part.tile, part.source, sequence++, block.num_points, hash64(block.data),
                block.data)
          .run();
    }
    update_summary_
        .bind(merged.num_points, merged.blocks.size(), merged.num_bytes, part.tile, part.source)
        .run();
    update_source_.bind(merged.counts.num_duplicates, merged.counts.num_thinned, part.source).run();
  }

  db::Database* database_;
  const RunContext* context_;
  db::Statement next_part_, select_blocks_, delete_blocks_, insert_block_, update_summary_,
      update_source_;
  std::int64_t last_tile_ = 0, last_source_ = 0;  // ids count from 1
  std::uint64_t num_parts_ = 0, num_done_ = 0, num_merged_ = 0;
};

std::uint64_t database_bytes(db::Database& database) {
  return static_cast<std::uint64_t>(database.query_int("PRAGMA page_count") *
                                    database.query_int("PRAGMA page_size"));
}

}  // namespace

CompactReport PointStore::compact(const RunContext& context) {
  CompactReport report;
  db::Database& database = impl_->database;
  report.file_bytes_before = database_bytes(database);
  report.num_blocks_before = totals().num_blocks;
  delete_unpublished(database, context);
  report.num_merged = Compactor(database, context).run();
  give_back_free_pages(database, context);
  context.throw_if_stopped();
  report.num_blocks_after = totals().num_blocks;
  report.file_bytes_after = database_bytes(database);
  return report;
}

}  // namespace gdfmap
