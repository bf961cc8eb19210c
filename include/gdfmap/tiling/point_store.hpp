#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <gdfmap/core/cube_mask.hpp>
#include <gdfmap/core/hash.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/db/database.hpp>
#include <gdfmap/tiling/block_codec.hpp>

namespace gdfmap {

/// What became of the points of one source: read = stored + duplicates + rejected.
struct IngestCounts {
  std::uint64_t num_read = 0;
  std::uint64_t num_stored = 0;
  std::uint64_t num_duplicates = 0;             ///< equal to another point of their block
  std::uint64_t num_rejected_not_finite = 0;    ///< NaN or infinite
  std::uint64_t num_rejected_withheld = 0;      ///< marked by the file (LAS)
  std::uint64_t num_rejected_zero = 0;          ///< exactly (0, 0, 0), with drop_zero
  std::uint64_t num_rejected_out_of_range = 0;  ///< beyond the lattice

  [[nodiscard]] std::uint64_t num_rejected() const {
    return num_rejected_not_finite + num_rejected_withheld + num_rejected_zero +
           num_rejected_out_of_range;
  }
  bool operator==(const IngestCounts&) const = default;
};

/// One ingested cloud.
struct SourceRecord {
  std::int64_t id = 0;
  std::string path;        ///< as given, for people
  std::string parameters;  ///< canonical text of scale, transform and filters, part of the identity
  Digest identity;         ///< of the file's bytes and the parameters
  std::uint64_t num_bytes = 0;
  IngestCounts counts;
};

/// What training needs to know of a tile that holds published points.
struct TilePoints {
  TileKey key;
  CubeMask cubes;
  Digest
      digest;  ///< of the tile's point set: independent of order, blocks and duplicates in a block
  std::uint64_t num_points = 0;  ///< stored, over all blocks; duplicates between blocks counted
};

/// A block on its way into the store.
struct NewBlock {
  TileKey tile;
  std::uint32_t num_points = 0;
  CubeMask cubes;
  Digest digest;  ///< sum of the hashes of every accepted point, duplicates included
  Bytes data;
};

/// points.db: sources and their compressed point blocks (schema/points.sql). One writer at a time
/// (the map's lock); any number of readers, each with a PointStore of its own. Not thread-safe. A
/// writing store that is destroyed leaves one plain file, unless a reader still holds the log.
/// @throws Error kIo or kCorrupt from every member.
class PointStore {
 public:
  /// Creates the file only with OpenMode::kCreate; db::reading_mode() tells how a reader opens it.
  /// @param cache_bytes  SQLite's page cache, for writers
  PointStore(const std::filesystem::path& path, db::OpenMode mode,
             std::size_t cache_bytes = std::size_t{8} << 20);
  ~PointStore();
  PointStore(PointStore&&) noexcept;
  PointStore& operator=(PointStore&&) noexcept;

  /// Free text kept beside the data: "map_id", "geometry". Empty where the key was never set.
  [[nodiscard]] std::optional<std::string> meta(const std::string& key);
  void set_meta(const std::string& key, const std::string& value);

  /// @name Writing a source: begin, append any number of times, publish. Blocks are invisible to
  /// every reader until publish() commits, with synchronous=FULL.
  /// @{
  /// Deletes whatever an interrupted ingest left and returns the id of a new unpublished source.
  [[nodiscard]] std::int64_t begin_source(const std::string& path, const std::string& parameters);
  /// One transaction. Fastest where the blocks come in the order of their tiles' keys.
  void append(std::int64_t source, std::span<const NewBlock> blocks);
  /// Sets the source's identity, size and counts and makes it visible, in one transaction. Its path
  /// and parameters stay as begin_source() got them. @throws Error kUsage unless the source was
  /// begun and is not published, and when one of this identity is.
  void publish(const SourceRecord& source);
  /// Deletes the rows of an unpublished source in bounded transactions and gives their room back to
  /// the file system. A published source stays as it is.
  void discard(std::int64_t source);
  /// @}

  /// Deletes a published source: it vanishes at once, in one transaction with synchronous=FULL,
  /// then its rows go as discard() does it. @throws Error kUsage when there is no such source.
  void remove(std::int64_t source);

  /// Published sources by id.
  [[nodiscard]] std::vector<SourceRecord> sources();
  [[nodiscard]] std::optional<SourceRecord> find_source(const Digest& identity);
  [[nodiscard]] bool has_source_of_size(std::uint64_t num_bytes);

  /// Every tile with published points, in key order. `visit` may use the other members.
  void for_each_tile(const std::function<void(const TilePoints&)>& visit);
  [[nodiscard]] std::optional<TilePoints> find_tile(const TileKey& key);

  /// Decodes the published blocks of a tile one after the other, in the order of source and
  /// arrival. A point may come again in a later block. `visit` may use the other members, this one
  /// excepted.
  /// @throws Error kCorrupt naming tile, block and source when a block is damaged.
  void for_each_block(const TileKey& key,
                      const std::function<void(std::span<const TileOffset>)>& visit);

  /// Bytes of compressed blocks and number of stored points, published sources only.
  struct Totals {
    std::uint64_t num_points = 0, num_blocks = 0, num_tiles = 0, block_bytes = 0;
  };
  [[nodiscard]] Totals totals();

  /// SQLite's integrity check and counts; with `checksums` also every block's checksum, points and
  /// occupied cubes. Reads one snapshot: a writer beside it is no fault. Returns one line for each
  /// fault found; a damaged block is named with its tile and its source.
  /// @throws Error kInterrupted when stopped
  [[nodiscard]] std::vector<std::string> verify(bool checksums, const RunContext& context = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;  // statements point at their connection, which must not move
};

}  // namespace gdfmap
