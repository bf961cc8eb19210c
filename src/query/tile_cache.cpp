#include <gdfmap/core/error.hpp>
#include <gdfmap/query/tile_cache.hpp>

namespace gdfmap {
namespace {

/// About what an entry costs beside its tile: list node, map node, control block.
constexpr std::size_t kEntryBytes = 192;

}  // namespace

TileCache::TileCache(std::shared_ptr<TileSource> source, std::size_t max_bytes)
    : source_(std::move(source)), max_bytes_(max_bytes) {}

TileCache::Shard& TileCache::shard_of(const TileKey& key) {
  // The low bits choose the bucket within the shard's maps.
  return shards_[(TileKeyHash{}(key) >> 32) % kNumShards];
}

CachedTile TileCache::get(const TileKey& key) {
  Shard& shard = shard_of(key);
  std::unique_lock lock(shard.mutex);
  if (const auto found = shard.entries.find(key); found != shard.entries.end()) {
    ++shard.statistics.hits;
    shard.by_use.splice(shard.by_use.begin(), shard.by_use, found->second.position);
    return found->second.tile;
  }
  ++shard.statistics.misses;
  if (const auto flight = shard.loading.find(key); flight != shard.loading.end()) {
    const std::shared_future<CachedTile> result = flight->second;
    lock.unlock();
    return result.get();
  }
  std::promise<CachedTile> promise;
  shard.loading.emplace(key, promise.get_future().share());
  lock.unlock();
  try {
    promise.set_value(load(shard, key));
  } catch (...) {
    promise.set_exception(std::current_exception());
  }
  lock.lock();
  const auto flight = shard.loading.find(key);
  const std::shared_future<CachedTile> result = flight->second;
  shard.loading.erase(flight);
  lock.unlock();
  return result.get();
}

CachedTile TileCache::load(Shard& shard, const TileKey& key) {
  const CachedTile tile = read(shard, key);
  insert(shard, key, tile);
  shrink(shard);
  return tile;
}

CachedTile TileCache::read(Shard& shard, const TileKey& key) {
  {
    const std::lock_guard lock(shard.mutex);
    ++shard.statistics.loads;
  }
  try {
    const std::optional<TileRecord> record = source_->load(key);
    if (!record) return {TileAvailability::kAbsent, nullptr};
    return {TileAvailability::kLoaded, std::make_shared<const DecodedTile>(*record)};
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCorrupt && error.code() != ErrorCode::kIo) throw;
    const std::lock_guard lock(shard.mutex);
    ++shard.statistics.unreadable;
    if (shard.statistics.first_error.empty()) shard.statistics.first_error = error.what();
    return {TileAvailability::kUnreadable, nullptr};
  }
}

void TileCache::insert(Shard& shard, const TileKey& key, const CachedTile& tile) {
  const std::size_t num_bytes = kEntryBytes + (tile.tile ? tile.tile->num_bytes() : 0);
  const std::lock_guard lock(shard.mutex);
  shard.by_use.push_front(key);
  shard.entries.emplace(key, Entry{tile, num_bytes, shard.by_use.begin()});
  num_bytes_ += num_bytes;
}

void TileCache::shrink(Shard& newest) {
  // The budget is one for all shards, so that a tile larger than a shard's share can be held. The
  // newest tile goes last.
  if (num_bytes_ <= max_bytes_) return;
  evict(newest, 1);
  for (Shard& shard : shards_) {
    if (num_bytes_ <= max_bytes_) return;
    if (&shard != &newest) evict(shard, 0);
  }
  evict(newest, 0);
}

void TileCache::evict(Shard& shard, std::size_t num_kept) {
  const std::lock_guard lock(shard.mutex);
  while (num_bytes_ > max_bytes_ && shard.by_use.size() > num_kept) {
    const auto oldest = shard.entries.find(shard.by_use.back());
    num_bytes_ -= oldest->second.num_bytes;
    shard.entries.erase(oldest);
    shard.by_use.pop_back();
    ++shard.statistics.evictions;
  }
}

TileCacheStatistics TileCache::statistics() const {
  TileCacheStatistics total;
  for (const Shard& shard : shards_) {
    const std::lock_guard lock(shard.mutex);
    total.hits += shard.statistics.hits;
    total.misses += shard.statistics.misses;
    total.loads += shard.statistics.loads;
    total.evictions += shard.statistics.evictions;
    total.unreadable += shard.statistics.unreadable;
    total.num_tiles += shard.entries.size();
    if (total.first_error.empty()) total.first_error = shard.statistics.first_error;
  }
  total.num_bytes = num_bytes_;
  return total;
}

}  // namespace gdfmap
