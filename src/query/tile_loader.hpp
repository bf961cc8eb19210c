#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <unordered_set>

#include <gdfmap/query/tile_cache.hpp>

namespace gdfmap {

/// Brings tiles into a cache on a thread of its own, in the order of the requests. Thread-safe. The
/// destructor leaves out what has not begun.
class TileLoader {
 public:
  /// The cache outlives it.
  explicit TileLoader(TileCache& cache);
  ~TileLoader();
  TileLoader(const TileLoader&) = delete;
  TileLoader& operator=(const TileLoader&) = delete;

  /// Returns at once; a tile that is waiting already is not asked for again.
  void request(const TileKey& key);

 private:
  void run();

  TileCache& cache_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<TileKey> queue_;                         ///< guarded by mutex_
  std::unordered_set<TileKey, TileKeyHash> awaited_;  ///< those in queue_; guarded by mutex_
  bool ends_ = false;                                 ///< guarded by mutex_
  std::thread thread_;
};

}  // namespace gdfmap
