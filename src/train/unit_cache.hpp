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

/// The indices of the parts of tiles, built when they are first asked for, several parts of a tile
/// at once, since each time all of its blocks are decoded; a byte-bounded number is kept.
/// Thread-safe, while nobody else uses the store.
class UnitCache {
 public:
  using Index = std::shared_ptr<const NearestPointIndex>;
  struct Part {
    Octant octant;
    std::uint64_t num_points = 0;  ///< not set in a tile that is one part
  };

  /// @param tiles  outlives this object
  UnitCache(PointStore& store, std::span<const TilePoints> tiles, std::size_t max_bytes);

  /// The parts of a tile in Morton order, few enough points in each. Valid as long as this object.
  [[nodiscard]] std::span<const Part> parts(std::size_t tile);

  /// The index of parts(tile)[part]. Another thread that builds it is waited for.
  [[nodiscard]] Index index(std::size_t tile, std::size_t part);

  /// Whether the indices of so many points can be kept together.
  [[nodiscard]] bool has_room_for(std::uint64_t num_points) const;
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

  /// A part that this thread has to build.
  struct Claim {
    std::size_t part;
    std::promise<Index> index;
    bool is_kept = false;
  };

  [[nodiscard]] std::vector<Part> split(const TilePoints& tile);
  [[nodiscard]] std::vector<Claim> claim(std::size_t tile, std::size_t part,
                                         std::span<const Part> parts);
  void build(std::size_t tile, std::span<const Part> parts, std::span<Claim> claims);
  void account(const Key& key, std::size_t bytes);
  void forget(const Key& key);

  PointStore& store_;
  std::span<const TilePoints> tiles_;
  std::size_t max_bytes_;

  std::mutex store_mutex_;
  mutable std::mutex mutex_;  // guards what follows; never held while store_mutex_ is taken
  std::unordered_map<std::size_t, std::vector<Part>> parts_;  // over-full tiles only, for good
  std::list<Entry> recent_;                                   // most recently used first
  std::unordered_map<Key, std::list<Entry>::iterator, KeyHash> entries_;
  std::size_t bytes_ = 0;
};

}  // namespace gdfmap
