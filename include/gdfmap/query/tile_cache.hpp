#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

#include <gdfmap/query/decoded_tile.hpp>
#include <gdfmap/query/tile_source.hpp>

namespace gdfmap {

enum class TileAvailability {
  kAbsent,      ///< nothing is stored for this tile
  kLoaded,      ///< the tile is there
  kUnreadable,  ///< something is stored that cannot be read
  kPending,     ///< not in memory, and not waited for
};

/// What the cache knows of a tile. Holding it keeps the tile alive after it was evicted.
struct CachedTile {
  TileAvailability availability = TileAvailability::kAbsent;
  std::shared_ptr<const DecodedTile> tile;  ///< null unless kLoaded
};

struct TileCacheStatistics {
  /// Look-ups that were answered from memory. A batch looks a tile up a few times, not for every
  /// point.
  std::uint64_t hits = 0;
  std::uint64_t misses = 0;      ///< all others, also those that waited for another thread's load
  std::uint64_t loads = 0;       ///< calls of the source
  std::uint64_t evictions = 0;   ///< entries dropped for want of room
  std::uint64_t unreadable = 0;  ///< loads that failed
  std::size_t num_tiles = 0;     ///< entries held now, absent and unreadable tiles among them
  std::size_t num_bytes = 0;     ///< held now
  std::string first_error;       ///< message of the first load that failed

  /// Hits over look-ups; 0 before the first one.
  [[nodiscard]] double hit_rate() const {
    const std::uint64_t lookups = hits + misses;
    return lookups == 0 ? 0.0 : static_cast<double>(hits) / static_cast<double>(lookups);
  }
};

/// Decoded tiles, the least recently used of them dropped when they exceed a number of bytes. Tiles
/// that are absent or unreadable are remembered as such. Threads that ask for one tile at the same
/// time load it once. Thread-safe.
///
/// Tiles that callers hold are not counted once they are evicted, so that a cache too small for a
/// single tile still serves.
class TileCache {
 public:
  TileCache(std::shared_ptr<TileSource> source, std::size_t max_bytes);

  /// An Error kCorrupt or kIo of the source becomes kUnreadable; anything else that it throws
  /// reaches every caller that waits for the tile, and the next one tries again.
  [[nodiscard]] CachedTile get(const TileKey& key);

  /// The same if it is in memory, else kPending at once.
  [[nodiscard]] CachedTile find(const TileKey& key);

  /// Drops the tiles of which the source has another version by now, and the unreadable ones.
  /// Returns their number. A get() that begins afterwards sees what was stored before this call.
  /// @throws Error kCorrupt or kIo when the source cannot be asked
  std::size_t refresh();

  [[nodiscard]] TileCacheStatistics statistics() const;

 private:
  static constexpr std::size_t kNumShards = 16;

  struct Entry {
    CachedTile tile;
    std::optional<TileVersion> version;
    std::size_t num_bytes = 0;
    std::list<TileKey>::iterator position;
  };
  /// A load that others wait for.
  struct Flight {
    std::shared_future<CachedTile> result;
    std::uint64_t num_refreshes = 0;  ///< when it began
  };
  struct Shard {
    mutable std::mutex mutex;
    std::unordered_map<TileKey, Entry, TileKeyHash> entries;
    std::list<TileKey> by_use;  ///< most recent first
    std::unordered_map<TileKey, Flight, TileKeyHash> loading;
    /// A load that one of them overtook is not kept, and nobody waits for it who comes afterwards.
    std::uint64_t num_refreshes = 0;
    TileCacheStatistics statistics;
  };

  Shard& shard_of(const TileKey& key);
  [[nodiscard]] CachedTile load(Shard& shard, const TileKey& key, std::uint64_t num_refreshes);
  [[nodiscard]] Entry read(Shard& shard, const TileKey& key);
  void insert(Shard& shard, const TileKey& key, Entry entry, std::uint64_t num_refreshes);
  std::size_t refresh(Shard& shard);
  void erase(Shard& shard, const TileKey& key);
  void shrink(Shard& newest);
  void evict(Shard& shard, std::size_t num_kept);

  std::shared_ptr<TileSource> source_;
  std::size_t max_bytes_;
  std::atomic<std::size_t> num_bytes_ = 0;
  std::array<Shard, kNumShards> shards_;
};

}  // namespace gdfmap
