#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace gdfmap {

/// Objects that are dear to make and that one thread at a time can use: as many are made as threads
/// ask for at the same time. Thread-safe; outlives what is borrowed.
template <typename T>
class Pool {
 public:
  /// An object on loan; gives it back when destroyed.
  class Lease {
   public:
    Lease(Pool& pool, std::unique_ptr<T> object) : pool_(pool), object_(std::move(object)) {}
    ~Lease() { pool_.give_back(std::move(object_)); }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;

    T& operator*() const { return *object_; }
    T* operator->() const { return object_.get(); }

   private:
    Pool& pool_;
    std::unique_ptr<T> object_;
  };

  /// An idle object, or make() where there is none. @param make  returns a std::unique_ptr<T>
  template <typename Make>
  [[nodiscard]] Lease borrow(const Make& make) {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<T> object = std::move(idle_.back());
        idle_.pop_back();
        return Lease(*this, std::move(object));
      }
    }
    return Lease(*this, make());
  }

 private:
  void give_back(std::unique_ptr<T> object) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(object));
  }

  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> idle_;
};

}  // namespace gdfmap
