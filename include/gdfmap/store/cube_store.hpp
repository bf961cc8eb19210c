#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/cube_mask.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/db/database.hpp>
#include <gdfmap/store/tile_record.hpp>

namespace gdfmap {

/// A tile's row, without its cubes.
struct TileState {
  TileKey key;
  Digest surroundings;
  Digest configuration;
  Digest content;
  CubeMask served;  ///< cubes that have Gaussians
  int num_cubes = 0, num_populated = 0, num_poor = 0, num_failed = 0;
  std::int64_t num_gaussians = 0;
  int num_measured = 0;  ///< cubes that have Gaussians and a known mean absolute error
  double mean_mae = 0.0, max_mae = 0.0;  ///< metres, over the measured cubes; 0 without any
  std::int64_t num_bytes = 0;            ///< of the encoded cubes
};

/// A tile in the form in which it is stored.
struct EncodedTile {
  TileState state;
  std::uint64_t checksum = 0;  ///< of the cubes
  Bytes surroundings;
  Bytes cubes;
};

/// A pure function, so that many threads can work for one writer.
/// @throws Error kInternal for a record that the format cannot hold, see encode_tile() and
///         encode_surroundings().
[[nodiscard]] EncodedTile encode(const TileRecord& tile);

/// The inverse, for any thread. @param database  what errors name before the tile
/// @throws Error kCorrupt naming both when the tile cannot be trusted.
[[nodiscard]] TileRecord decode(const EncodedTile& tile, const std::string& database);

/// Sums over all tiles.
struct CubeTotals {
  std::int64_t num_tiles = 0, num_cubes = 0, num_populated = 0, num_poor = 0, num_failed = 0;
  std::int64_t num_gaussians = 0, num_measured = 0, num_bytes = 0;
  double mean_mae = 0.0;  ///< metres, over the measured cubes; 0 without any
};

/// cubes.db: the trained field (schema/cubes.sql). One writer at a time (the map's lock); any
/// number of readers, each thread with a CubeStore of its own. Not thread-safe.
/// @throws Error kIo or kCorrupt, with the path, from every member.
class CubeStore {
 public:
  /// @param cache_bytes  SQLite's page cache
  CubeStore(const std::filesystem::path& path, db::OpenMode mode,
            std::size_t cache_bytes = std::size_t{8} << 20);
  /// A store that writes folds its log into the file, so that a map at rest is plain files.
  ~CubeStore();
  CubeStore(CubeStore&&) noexcept;
  CubeStore& operator=(CubeStore&&) noexcept;

  [[nodiscard]] std::optional<std::string> meta(const std::string& key);
  void set_meta(const std::string& key, const std::string& value);

  /// @name Writing
  /// @{
  /// Replaces the cubes and digests of these tiles in one transaction.
  void put(std::span<const EncodedTile> tiles);
  /// The same with encode() before it.
  void put(std::span<const TileRecord> tiles);
  void erase(
      std::span<const TileKey> tiles);  ///< one transaction; keys that are absent are ignored
  /// Replaces the table of occupied tiles (in any order, each once) in one transaction, when it
  /// differs.
  void set_occupied(std::span<const OccupiedTile> tiles);
  /// Deletes in one transaction every tile that verify(true) would name, and cubes without a tile,
  /// so that what is left can be trusted. Returns one line for each.
  /// @throws Error kInterrupted when stopped, nothing deleted; kCorrupt when the file itself is
  ///         damaged beyond its tiles.
  [[nodiscard]] std::vector<std::string> delete_damaged(const RunContext& context = {});
  /// @}

  /// Every tile, in key order. The visitor must not write to this store.
  void for_each_state(const std::function<void(const TileState&)>& visit);
  [[nodiscard]] std::optional<TileState> find_state(const TileKey& key);
  /// As it is stored, unchecked.
  [[nodiscard]] std::optional<EncodedTile> read_encoded(const TileKey& key);
  /// The same with decode() behind it.
  [[nodiscard]] std::optional<TileRecord> read(const TileKey& key);
  /// Occupied tiles in key order.
  [[nodiscard]] std::vector<OccupiedTile> occupied();

  [[nodiscard]] CubeTotals totals();
  /// Whether any tile has a cube, without reading them all.
  [[nodiscard]] bool has_cubes();
  /// Digest over the content digests of all tiles that have cubes, in key order; of no bytes when
  /// there is none.
  [[nodiscard]] Digest content_digest();

  /// SQLite's integrity check, and that the tables agree with each other; with `checksums` also
  /// every tile's checksum, bytes, counts and content digest. Reads one snapshot: a writer beside
  /// it is no fault. Returns one line for each fault found.
  /// @throws Error kInterrupted when stopped
  [[nodiscard]] std::vector<std::string> verify(bool checksums, const RunContext& context = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gdfmap
