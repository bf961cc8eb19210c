#include "unit_cache.hpp"

#include <algorithm>
#include <array>
#include <exception>
#include <utility>

namespace gdfmap {
namespace {

/// Points beyond which a part of a tile is split into octants.
constexpr std::uint64_t kMaxUnitPoints = 250'000;

}  // namespace

std::vector<Octant> UnitCache::parts(std::size_t tile) {
  if (tiles_[tile].num_points <= kMaxUnitPoints) return {Octant{}};
  const std::lock_guard store_lock(store_mutex_);
  {
    const std::lock_guard lock(mutex_);
    const auto known = parts_.find(tile);
    if (known != parts_.end()) return known->second;
  }
  std::vector<Octant> result;
  split(tiles_[tile].key, Octant{}, result);
  const std::lock_guard lock(mutex_);
  return parts_[tile] = std::move(result);
}

void UnitCache::split(const TileKey& key, const Octant& octant, std::vector<Octant>& result) {
  std::array<std::uint64_t, 8> counts{};
  const int half = octant.size / 2;
  store_.for_each_block(key, [&](std::span<const TileOffset> points) {
    for (const TileOffset& p : points) {
      if (!octant.contains(p)) continue;
      ++counts[static_cast<std::size_t>((p.x - octant.x >= half ? 1 : 0) +
                                        (p.y - octant.y >= half ? 2 : 0) +
                                        (p.z - octant.z >= half ? 4 : 0))];
    }
  });
  for (int i = 0; i < 8; ++i) {
    const std::uint64_t count = counts[static_cast<std::size_t>(i)];
    if (count == 0) continue;
    // An octant of one step holds one point, however often blocks repeat it.
    if (count > kMaxUnitPoints && half > 1) {
      split(key, octant.child(i), result);
    } else {
      result.push_back(octant.child(i));
    }
  }
}

UnitCache::Index UnitCache::build(const TilePoints& tile, const Octant& octant) {
  std::vector<NearestPointIndex::Point> points;
  points.reserve(std::min(tile.num_points, kMaxUnitPoints));
  {
    const std::lock_guard lock(store_mutex_);
    store_.for_each_block(tile.key, [&](std::span<const TileOffset> block) {
      for (const TileOffset& p : block) {
        if (octant.contains(p)) points.push_back({p.x, p.y, p.z});
      }
    });
  }
  return std::make_shared<const NearestPointIndex>(points);
}

UnitCache::Index UnitCache::index(std::size_t tile, std::size_t part, const Octant& octant) {
  const Key key{tile, part};
  std::promise<Index> promise;
  {
    std::unique_lock lock(mutex_);
    const auto found = entries_.find(key);
    if (found != entries_.end()) {
      recent_.splice(recent_.begin(), recent_, found->second);
      const std::shared_future<Index> index = found->second->index;
      lock.unlock();
      return index.get();
    }
    recent_.push_front({key, promise.get_future().share()});
    entries_[key] = recent_.begin();
  }
  try {
    Index index = build(tiles_[tile], octant);
    promise.set_value(index);
    account(key, index->memory_bytes());
    return index;
  } catch (...) {
    promise.set_exception(std::current_exception());
    forget(key);
    throw;
  }
}

void UnitCache::account(const Key& key, std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  entries_.at(key)->bytes = bytes;
  bytes_ += bytes;
  for (auto oldest = recent_.end(); bytes_ > max_bytes_ && oldest != recent_.begin();) {
    --oldest;
    if (oldest->bytes == 0 || oldest->key == key) continue;
    bytes_ -= oldest->bytes;
    entries_.erase(oldest->key);
    oldest = recent_.erase(oldest);
  }
}

void UnitCache::forget(const Key& key) {
  const std::lock_guard lock(mutex_);
  recent_.erase(entries_.at(key));
  entries_.erase(key);
}

bool UnitCache::is_full() const {
  const std::lock_guard lock(mutex_);
  return bytes_ >= max_bytes_;
}

}  // namespace gdfmap
