#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <gdfmap/query/tile_cache.hpp>

namespace gdfmap {

/// The tiles around the points that one thread works on, so that most look-ups need no lock. A
/// query needs at most 2 × 2 × 2 neighbouring tiles of a level; neighbours differ in the parity of
/// a coordinate and so never take each other's place.
class TileCursor {
 public:
  explicit TileCursor(TileCache& cache) : cache_(&cache) {}

  /// Valid until a tile of the same level and parities is asked for; the tile itself until
  /// release().
  [[nodiscard]] const CachedTile& get(const TileKey& key) {
    Slot& slot = slots_[static_cast<std::size_t>(key.level * 8 + (key.x & 1) + 2 * (key.y & 1) +
                                                 4 * (key.z & 1))];
    if (slot.key != key) [[unlikely]] {
      if (slot.tile.tile) replaced_.push_back(std::move(slot.tile.tile));
      slot.tile = cache_->get(key);
      slot.key = key;
    }
    return slot.tile;
  }

  /// Tiles that gave way to others and are still held.
  [[nodiscard]] std::size_t num_replaced() const { return replaced_.size(); }
  void release() { replaced_.clear(); }

 private:
  struct Slot {
    TileKey key{-1, 0, 0, 0};
    CachedTile tile;
  };

  TileCache* cache_;
  std::array<Slot, std::size_t{8} * kMaxLevels> slots_;
  std::vector<std::shared_ptr<const DecodedTile>> replaced_;
};

}  // namespace gdfmap
