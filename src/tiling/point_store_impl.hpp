#pragma once

#include <optional>

#include <gdfmap/tiling/point_store.hpp>

namespace gdfmap {

/// A row of tile_sources: what one source put into one tile.
struct TileSummary {
  Digest digest;
  std::uint64_t num_points = 0;
  std::uint64_t num_blocks = 0;
  std::uint64_t block_bytes = 0;
  CubeMask cubes;

  void add(const NewBlock& block);
};

/// The columns of a TileSummary, and how many they are.
inline constexpr char kSummaryColumns[] =
    "digest_low, digest_high, num_points, num_blocks, block_bytes, "
    "cubes_0, cubes_1, cubes_2, cubes_3, cubes_4, cubes_5, cubes_6, cubes_7";
inline constexpr int kNumSummaryColumns = 13;

/// Reads kSummaryColumns, the first of which is the given one.
[[nodiscard]] TileSummary read_summary(const db::Statement& row, int first_column);

/// The columns of a block `b` of a tile `t` and a source `s`, and how many they are.
inline constexpr char kBlockColumns[] =
    "t.x, t.y, t.z, b.id, s.id, s.path, b.num_points, b.checksum, b.data";
inline constexpr int kNumBlockColumns = 9;

/// "tile (1, 2, 3), block 4 of source 5 (scan.ply)", from kBlockColumns, the first columns.
[[nodiscard]] std::string block_name(const db::Statement& row);

/// Checks and decodes a block, from the same columns. @throws Error kCorrupt with its name.
[[nodiscard]] std::vector<TileOffset> read_block(const db::Statement& row);
/// The same; the error names the file too.
[[nodiscard]] std::vector<TileOffset> read_block(const db::Statement& row,
                                                 const std::filesystem::path& path);

/// Deletes the sources that nobody published, or that were removed, with all their rows, in bounded
/// transactions; asked to stop, it leaves the rest. @param kept  ids that stay all the same
void delete_unpublished(db::Database& database, const RunContext& context,
                        std::span<const std::int64_t> kept = {});

/// Returns free pages to the file system, a bounded number a transaction, until asked to stop.
void give_back_free_pages(db::Database& database, const RunContext& context);

/// Makes commits durable while it lives; after that a crash of the machine may undo the last ones.
class FullSync {
 public:
  explicit FullSync(db::Database& database);
  ~FullSync();
  FullSync(const FullSync&) = delete;
  FullSync& operator=(const FullSync&) = delete;

 private:
  db::Database* database_;
};

/// The statements of append(), prepared once.
class BlockInserter {
 public:
  explicit BlockInserter(db::Database& database);
  void insert(std::int64_t source, const NewBlock& block);

 private:
  [[nodiscard]] std::int64_t tile_id(const TileKey& key);
  [[nodiscard]] TileSummary summary(std::int64_t tile, std::int64_t source);
  void put_summary(std::int64_t tile, std::int64_t source, const TileSummary& summary);

  db::Database* database_;
  db::Statement select_tile_, insert_tile_, select_summary_, put_summary_, insert_block_;
};

struct PointStore::Impl {
  Impl(const std::filesystem::path& path, db::OpenMode mode, std::size_t cache_bytes);
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  db::Database database;
  bool writes;
  bool knows_sensors;                ///< a reader may have an older file without their columns
  std::vector<std::int64_t> staged;  ///< begun by this object, neither published nor discarded
  std::optional<db::Statement> select_tile, select_blocks;
  std::optional<BlockInserter> inserter;
};

}  // namespace gdfmap
