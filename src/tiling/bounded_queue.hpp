#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace gdfmap {

/// Hands items from thread to thread in their order; whoever is too fast waits. Thread-safe.
template <typename T>
class BoundedQueue {
 public:
  /// @param max_items  together with the size of an item, the bound of the memory in flight
  explicit BoundedQueue(std::size_t max_items) : max_items_(max_items) {}

  /// Waits for room; false, and the item is dropped, once the queue is closed.
  bool push(T item) {
    std::unique_lock lock(mutex_);
    has_room_.wait(lock, [&] { return closed_ || items_.size() < max_items_; });
    if (closed_) return false;
    items_.push_back(std::move(item));
    has_items_.notify_one();
    return true;
  }
  /// Waits for an item; empty once the queue is closed and used up.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    has_items_.wait(lock, [&] { return closed_ || !items_.empty(); });
    if (items_.empty()) return std::nullopt;
    std::optional<T> item(std::move(items_.front()));
    items_.pop_front();
    has_room_.notify_one();
    return item;
  }
  /// Nothing more comes; what is in the queue can still be popped.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    has_room_.notify_all();
    has_items_.notify_all();
  }
  /// close(), and what is in the queue is dropped.
  void abandon() {
    close();
    const std::lock_guard lock(mutex_);
    items_.clear();
  }

 private:
  std::size_t max_items_;
  std::mutex mutex_;
  std::condition_variable has_room_, has_items_;
  std::deque<T> items_;
  bool closed_ = false;
};

}  // namespace gdfmap
