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

/// What became of the points of one source: read = stored + duplicates + thinned + rejected.
struct IngestCounts {
  std::uint64_t num_read = 0;
  std::uint64_t num_stored = 0;
  std::uint64_t num_duplicates = 0;             ///< equal to another point of their block
  std::uint64_t num_thinned = 0;                ///< given up for another point of their voxel
  std::uint64_t num_rejected_not_finite = 0;    ///< NaN or infinite
  std::uint64_t num_rejected_withheld = 0;      ///< marked by the file (LAS)
  std::uint64_t num_rejected_zero = 0;          ///< exactly (0, 0, 0), with drop_zero
  std::uint64_t num_rejected_out_of_range = 0;  ///< beyond the lattice
  std::uint64_t num_rejected_outside = 0;       ///< not in the region asked for

  [[nodiscard]] std::uint64_t num_rejected() const {
    return num_rejected_not_finite + num_rejected_withheld + num_rejected_zero +
           num_rejected_out_of_range + num_rejected_outside;
  }
  IngestCounts& operator+=(const IngestCounts& other);
  bool operator==(const IngestCounts&) const = default;
};

/// One ingested cloud.
struct SourceRecord {
  std::int64_t id = 0;
  std::string path;        ///< as given, for people
  std::string parameters;  ///< canonical text of scale, transform and filters, part of the identity
  int voxel_steps = 0;     ///< edge of a thinning voxel in quantisation steps; 0: not thinned
  Digest identity;         ///< of the file's bytes and the parameters
  std::uint64_t num_bytes = 0;
  IngestCounts counts;
  /// Where the sensor stood, in the map's frame, metres; empty where nobody said. No part of the
  /// identity: the points are the same.
  std::optional<Vector3> sensor_origin = std::nullopt;
  /// How registration moved the points, as Alignment::text() says it; empty: it did not.
  std::string alignment = {};
};

/// What training needs to know of a tile that holds published points.
struct TilePoints {
  TileKey key;
  CubeMask cubes;
  /// Of the tile's point set: independent of order, blocks and duplicates in a block. The sum of
  /// those of its shares, from which sums over several tiles tell them apart: points are hashed by
  /// their place in the world.
  Digest digest;
  std::uint64_t num_points = 0;  ///< stored, over all blocks; what they share is counted again
};

/// What one published source has in a tile.
struct SourceShare {
  std::int64_t source = 0;
  Digest digest;  ///< of the points and the voxels
  CubeMask cubes;
};

/// A block on its way into the store.
struct NewBlock {
  TileKey tile;
  std::uint32_t num_points = 0;
  CubeMask cubes;
  Digest digest;  ///< sum of the hashes of every accepted point, whether it was stored or not
  Bytes data;
};

/// What compact() did.
struct CompactReport {
  std::uint64_t num_merged = 0;  ///< pairs of tile and source whose blocks were merged
  std::uint64_t num_blocks_before = 0, num_blocks_after = 0;  ///< all published blocks
  std::uint64_t file_bytes_before = 0, file_bytes_after = 0;  ///< of the database
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

  [[nodiscard]] const std::filesystem::path& path() const;

  /// Free text kept beside the data: "map_id", "geometry". Empty where the key was never set.
  [[nodiscard]] std::optional<std::string> meta(const std::string& key);
  void set_meta(const std::string& key, const std::string& value);

  /// @name Writing a source: begin, append any number of times, publish. Blocks are invisible to
  /// every reader until publish() commits, with synchronous=FULL.
  /// @{
  /// Deletes whatever an interrupted ingest left and returns the id of a new unpublished source.
  /// Other sources that this object has begun stay: several can be published together.
  [[nodiscard]] std::int64_t begin_source(const std::string& path, const std::string& parameters,
                                          int voxel_steps = 0);
  /// One transaction. Fastest where the blocks come in the order of their tiles' keys.
  void append(std::int64_t source, std::span<const NewBlock> blocks);
  /// Sets identity, size, counts, sensor and alignment of sources and makes all of them visible, in
  /// one transaction, in which `replaced` vanishes; its rows stay until discard(). Path, parameters
  /// and voxels stay as begin_source() got them. @throws Error kUsage unless every source was begun
  /// and is not published, when one of its identity is, and unless `replaced` is published.
  void publish(std::span<const SourceRecord> sources,
               std::optional<std::int64_t> replaced = std::nullopt);
  void publish(const SourceRecord& source, std::optional<std::int64_t> replaced = std::nullopt) {
    publish(std::span(&source, 1), replaced);
  }
  /// Deletes the rows of an unpublished source in bounded transactions and gives their room back to
  /// the file system. A published source stays as it is. Asked to stop, it leaves the rest to the
  /// next writer.
  void discard(std::int64_t source, const RunContext& context = {});
  /// @}

  /// Deletes a published source: it vanishes at once, in one transaction with synchronous=FULL,
  /// then its rows go as discard() does it. @throws Error kUsage when there is no such source.
  void remove(std::int64_t source, const RunContext& context = {});

  /// Says where the sensor of a published source stood; nothing else changes. One transaction with
  /// synchronous=FULL. @throws Error kUsage when there is no such source.
  void set_sensor_origin(std::int64_t source, const Vector3& p_map);

  /// Merges the blocks that a source has in a tile, wherever that makes fewer or smaller ones, and
  /// gives the room back to the file system. Neither a point set nor a digest changes; what blocks
  /// of one source shared is now counted as duplicate or thinned. In transactions of a few
  /// megabytes, or of one source's part of one tile; asked to stop, it ends after one, and goes on
  /// when it is called again. Memory: a million points, or those of the fullest cube.
  /// @throws Error kCorrupt naming a damaged block, which stays; what was merged before it stays.
  CompactReport compact(const RunContext& context = {});

  /// Published sources by id.
  [[nodiscard]] std::vector<SourceRecord> sources();
  [[nodiscard]] std::optional<SourceRecord> find_source(const Digest& identity);
  [[nodiscard]] bool has_source_of_size(std::uint64_t num_bytes);

  /// Every tile with published points, in key order. `visit` may use the other members.
  void for_each_tile(const std::function<void(const TilePoints&)>& visit);
  [[nodiscard]] std::optional<TilePoints> find_tile(const TileKey& key);
  /// What a tile consists of, by ascending source.
  [[nodiscard]] std::vector<SourceShare> shares(const TileKey& key);

  /// Visits the points of a tile in pieces: the published blocks of sources that are not thinned,
  /// in the order of source and arrival, then for every size of voxel what is left of all sources
  /// that have it. A point may come again in a later piece. `visit` may use the other members, this
  /// one excepted. Memory: a block; where sources are thinned, a million points or those of the
  /// fullest cube.
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
