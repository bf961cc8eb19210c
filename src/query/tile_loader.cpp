#include "tile_loader.hpp"

namespace gdfmap {

TileLoader::TileLoader(TileCache& cache) : cache_(cache), thread_([this] { run(); }) {}

TileLoader::~TileLoader() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void TileLoader::request(const TileKey& key) {
  {
    const std::lock_guard lock(mutex_);
    if (!awaited_.insert(key).second) return;
    queue_.push_back(key);
  }
  wake_.notify_one();
}

void TileLoader::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return ends_ || !queue_.empty(); });
    if (ends_) return;
    const TileKey key = queue_.front();
    queue_.pop_front();
    lock.unlock();
    try {
      static_cast<void>(cache_.get(key));
    } catch (...) {
      // Whoever waits for the tile meets the same failure and tells of it.
    }
    lock.lock();
    awaited_.erase(key);
  }
}

}  // namespace gdfmap
