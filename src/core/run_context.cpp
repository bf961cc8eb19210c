#include <algorithm>
#include <thread>

#include <unistd.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/run_context.hpp>

namespace gdfmap {

void RunContext::throw_if_stopped() const {
  if (stop_requested()) throw Error(ErrorCode::kInterrupted, "interrupted");
}

int RunContext::threads() const {
  if (num_threads > 0) return num_threads;
  return static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

std::size_t RunContext::memory() const {
  return memory_bytes > 0 ? memory_bytes : default_memory_bytes();
}

std::size_t default_memory_bytes() {
  const auto pages = static_cast<std::size_t>(std::max(0L, sysconf(_SC_PHYS_PAGES)));
  const auto page_bytes = static_cast<std::size_t>(std::max(0L, sysconf(_SC_PAGESIZE)));
  return std::clamp(pages * page_bytes / 4, kMinMemoryBytes, std::size_t{4} << 30);
}

}  // namespace gdfmap
