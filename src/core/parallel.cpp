#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>

#include <gdfmap/core/parallel.hpp>

namespace gdfmap {

void parallel_for(std::size_t count, int num_threads,
                  const std::function<void(std::size_t)>& body) {
  std::atomic<bool> failed = false;
  std::exception_ptr first_error;
  std::mutex error_mutex;
  const auto n = static_cast<std::int64_t>(count);
#pragma omp parallel for schedule(dynamic) num_threads(num_threads)
  for (std::int64_t i = 0; i < n; ++i) {
    if (failed.load(std::memory_order_relaxed)) continue;
    try {  // an exception must not leave an OpenMP region
      body(static_cast<std::size_t>(i));
    } catch (...) {
      const std::lock_guard lock(error_mutex);
      if (!first_error) first_error = std::current_exception();
      failed.store(true, std::memory_order_relaxed);
    }
  }
  if (first_error) std::rethrow_exception(first_error);
}

}  // namespace gdfmap
