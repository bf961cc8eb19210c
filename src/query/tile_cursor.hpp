#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <gdfmap/query/tile_cache.hpp>

#include "tile_loader.hpp"

namespace gdfmap {

/// The tiles around the points that one thread works on, so that most look-ups need no lock. A
/// query needs at most 2 × 2 × 2 neighbouring tiles of a level; neighbours differ in the parity of
/// a coordinate and so never take each other's place.
class TileCursor {
 public:
  /// @param loader  fetches tiles that are not in memory, which are kPending meanwhile; null: they
  ///                are waited for
  explicit TileCursor(TileCache& cache, TileLoader* loader = nullptr)
      : cache_(&cache), loader_(loader) {}

  /// Valid until a tile of the same level and parities is asked for; the tile itself until
  /// release().
  [[nodiscard]] const CachedTile& get(const TileKey& key) {
    Slot& slot = slots_[static_cast<std::size_t>(key.level * 8 + (key.x & 1) + 2 * (key.y & 1) +
                                                 4 * (key.z & 1))];
    if (slot.key != key) [[unlikely]] {
      if (slot.tile.tile) replaced_.push_back(std::move(slot.tile.tile));
      slot.tile = fetch(key);
      slot.key = key;
    }
    return slot.tile;
  }

  /// Tiles that gave way to others and are still held.
  [[nodiscard]] std::size_t num_replaced() const { return replaced_.size(); }
  void release() { replaced_.clear(); }

 private:
  CachedTile fetch(const TileKey& key) {
    if (loader_ == nullptr) return cache_->get(key);
    CachedTile tile = cache_->find(key);
    if (tile.availability == TileAvailability::kPending) loader_->request(key);
    return tile;
  }

  struct Slot {
    TileKey key{-1, 0, 0, 0};
    CachedTile tile;
  };

  TileCache* cache_;
  TileLoader* loader_;
  std::array<Slot, std::size_t{8} * kMaxLevels> slots_;
  std::vector<std::shared_ptr<const DecodedTile>> replaced_;
};

}  // namespace gdfmap
