#pragma once

#include <cstddef>
#include <cstdint>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <unordered_map>
#include <vector>

#include <gdfmap/edt/nearest_point_index.hpp>
#include <gdfmap/tiling/point_store.hpp>

namespace gdfmap {

/// A cubic part of a tile, in steps from the tile's corner.
struct Octant {
  std::int32_t x = 0, y = 0, z = 0;
  std::int32_t size = kStepsPerTileAxis;

  [[nodiscard]] bool contains(const TileOffset& p) const {
    return p.x - x >= 0 && p.x - x < size && p.y - y >= 0 && p.y - y < size && p.z - z >= 0 &&
           p.z - z < size;
  }
  [[nodiscard]] Octant child(int index) const {
    const std::int32_t half = size / 2;
    return {x + (index & 1) * half, y + (index >> 1 & 1) * half, z + (index >> 2 & 1) * half, half};
  }
  [[nodiscard]] Eigen::AlignedBox3f box() const {
    const Eigen::Vector3f low(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    return {low, low + Eigen::Vector3f::Constant(static_cast<float>(size - 1))};
  }
};

/// The indices of the parts of tiles, built when they are first asked for; a byte-bounded number is
/// kept. Thread-safe, while nobody else uses the store.
class UnitCache {
 public:
  using Index = std::shared_ptr<const NearestPointIndex>;

  /// @param tiles  outlives this object
  UnitCache(PointStore& store, std::span<const TilePoints> tiles, std::size_t max_bytes)
      : store_(store), tiles_(tiles), max_bytes_(max_bytes) {}

  /// The parts of a tile, few enough points in each.
  [[nodiscard]] std::vector<Octant> parts(std::size_t tile);

  /// The index of part `part` of a tile. Another thread that builds it is waited for.
  [[nodiscard]] Index index(std::size_t tile, std::size_t part, const Octant& octant);

  /// Whether further indices would push others out.
  [[nodiscard]] bool is_full() const;

 private:
  struct Key {
    std::size_t tile = 0, part = 0;
    bool operator==(const Key&) const = default;
  };
  struct KeyHash {
    std::size_t operator()(const Key& key) const noexcept { return key.tile * 4099 + key.part; }
  };
  struct Entry {
    Key key;
    std::shared_future<Index> index;
    std::size_t bytes = 0;  ///< 0 while it is built
  };

  void split(const TileKey& key, const Octant& octant, std::vector<Octant>& result);
  [[nodiscard]] Index build(const TilePoints& tile, const Octant& octant);
  void account(const Key& key, std::size_t bytes);
  void forget(const Key& key);

  PointStore& store_;
  std::span<const TilePoints> tiles_;
  std::size_t max_bytes_;

  std::mutex store_mutex_;
  mutable std::mutex mutex_;  // guards what follows; never taken before store_mutex_ is released
  std::unordered_map<std::size_t, std::vector<Octant>> parts_;  // over-full tiles only
  std::list<Entry> recent_;                                     // most recently used first
  std::unordered_map<Key, std::list<Entry>::iterator, KeyHash> entries_;
  std::size_t bytes_ = 0;
};

}  // namespace gdfmap
