#pragma once

#include <array>
#include <cstddef>

#include <gdfmap/query/tile_cache.hpp>

namespace gdfmap {

/// The tiles around the points that one thread works on, so that most look-ups need no lock. A
/// query needs at most 2 × 2 × 2 neighbouring tiles of a level; neighbours differ in the parity of
/// a coordinate and so never take each other's place.
class TileCursor {
 public:
  explicit TileCursor(TileCache& cache) : cache_(&cache) {}

  /// Valid until a tile of the same level and parities is asked for.
  [[nodiscard]] const CachedTile& get(const TileKey& key) {
    Slot& slot = slots_[static_cast<std::size_t>(key.level * 8 + (key.x & 1) + 2 * (key.y & 1) +
                                                 4 * (key.z & 1))];
    if (slot.key != key) {
      slot.tile = cache_->get(key);
      slot.key = key;
    }
    return slot.tile;
  }

 private:
  struct Slot {
    TileKey key{-1, 0, 0, 0};
    CachedTile tile;
  };

  TileCache* cache_;
  std::array<Slot, std::size_t{8} * kMaxLevels> slots_;
};

}  // namespace gdfmap
