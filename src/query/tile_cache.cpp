#include <utility>
#include <vector>

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
    const std::shared_future<CachedTile> result = flight->second.result;
    lock.unlock();
    return result.get();
  }
  ++shard.statistics.loads;
  const std::uint64_t num_refreshes = shard.num_refreshes;
  std::promise<CachedTile> promise;
  const std::shared_future<CachedTile> result = promise.get_future().share();
  shard.loading.emplace(key, Flight{result, num_refreshes});
  lock.unlock();
  try {
    promise.set_value(load(shard, key, num_refreshes));
  } catch (...) {
    promise.set_exception(std::current_exception());
  }
  lock.lock();
  const auto flight = shard.loading.find(key);
  const bool is_ours =
      flight != shard.loading.end() && flight->second.num_refreshes == num_refreshes;
  if (is_ours) shard.loading.erase(flight);
  lock.unlock();
  return result.get();
}

CachedTile TileCache::find(const TileKey& key) {
  Shard& shard = shard_of(key);
  const std::lock_guard lock(shard.mutex);
  const auto found = shard.entries.find(key);
  if (found == shard.entries.end()) {
    ++shard.statistics.misses;
    return {TileAvailability::kPending, nullptr};
  }
  ++shard.statistics.hits;
  shard.by_use.splice(shard.by_use.begin(), shard.by_use, found->second.position);
  return found->second.tile;
}

CachedTile TileCache::load(Shard& shard, const TileKey& key, std::uint64_t num_refreshes) {
  Entry entry = read(shard, key);
  CachedTile tile = entry.tile;
  insert(shard, key, std::move(entry), num_refreshes);
  shrink(shard);
  return tile;
}

TileCache::Entry TileCache::read(Shard& shard, const TileKey& key) {
  try {
    // The version first: should the tile change in between, it is taken for older than it is.
    const std::optional<TileVersion> version = source_->version(key);
    const std::optional<TileRecord> record = source_->load(key);
    if (!record) return {{TileAvailability::kAbsent, nullptr}, version, 0, {}};
    return {
        {TileAvailability::kLoaded, std::make_shared<const DecodedTile>(*record)}, version, 0, {}};
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCorrupt && error.code() != ErrorCode::kIo) throw;
    const std::lock_guard lock(shard.mutex);
    ++shard.statistics.unreadable;
    if (shard.statistics.first_error.empty()) shard.statistics.first_error = error.what();
    return {{TileAvailability::kUnreadable, nullptr}, std::nullopt, 0, {}};
  }
}

void TileCache::insert(Shard& shard, const TileKey& key, Entry entry, std::uint64_t num_refreshes) {
  entry.num_bytes = kEntryBytes + (entry.tile.tile ? entry.tile.tile->num_bytes() : 0);
  const std::lock_guard lock(shard.mutex);
  if (shard.num_refreshes != num_refreshes) return;
  shard.by_use.push_front(key);
  entry.position = shard.by_use.begin();
  num_bytes_ += entry.num_bytes;
  shard.entries.emplace(key, std::move(entry));
}

std::size_t TileCache::refresh() {
  std::size_t num_dropped = 0;
  for (Shard& shard : shards_) num_dropped += refresh(shard);
  return num_dropped;
}

std::size_t TileCache::refresh(Shard& shard) {
  std::vector<std::pair<TileKey, std::optional<TileVersion>>> held;
  std::size_t num_dropped = 0;
  {
    const std::lock_guard lock(shard.mutex);
    ++shard.num_refreshes;
    shard.loading.clear();
    for (auto entry = shard.entries.begin(); entry != shard.entries.end();) {
      const auto& [key, what] = *entry++;
      if (what.tile.availability == TileAvailability::kUnreadable) {
        erase(shard, TileKey(key));
        ++num_dropped;
      } else {
        held.emplace_back(key, what.version);
      }
    }
  }
  // The source takes its time: queries go on meanwhile.
  for (const auto& [key, version] : held) {
    if (source_->version(key) == version) continue;
    const std::lock_guard lock(shard.mutex);
    const auto found = shard.entries.find(key);
    if (found == shard.entries.end() || found->second.version != version) continue;
    erase(shard, key);
    ++num_dropped;
  }
  return num_dropped;
}

/// The caller holds the shard's mutex.
void TileCache::erase(Shard& shard, const TileKey& key) {
  const auto entry = shard.entries.find(key);
  num_bytes_ -= entry->second.num_bytes;
  shard.by_use.erase(entry->second.position);
  shard.entries.erase(entry);
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
    erase(shard, TileKey(shard.by_use.back()));
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
