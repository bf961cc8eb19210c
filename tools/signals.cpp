#include "signals.hpp"

#include <csignal>
#include <string_view>

#include <unistd.h>

#include <gdfmap/core/error.hpp>

namespace gdfmap::cli {
namespace {

std::atomic<bool> stop_requested = false;
std::atomic<bool> stops_in_good_order = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may not wait");

extern "C" void on_stop_signal(int /*signal*/) {
  if (!stops_in_good_order.load() || stop_requested.exchange(true)) {
    ::_exit(static_cast<int>(ErrorCode::kInterrupted));
  }
  if (::isatty(STDERR_FILENO) == 1) {
    constexpr std::string_view kNote = "\nstopping in good order; once more ends at once\n";
    [[maybe_unused]] const ssize_t ignored = ::write(STDERR_FILENO, kNote.data(), kNote.size());
  }
}

}  // namespace

void install_signal_handlers() {
  struct sigaction stop = {};
  stop.sa_handler = on_stop_signal;
  stop.sa_flags = SA_RESTART;
  sigemptyset(&stop.sa_mask);
  ::sigaction(SIGINT, &stop, nullptr);
  ::sigaction(SIGTERM, &stop, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

const std::atomic<bool>& watch_for_stop() {
  stops_in_good_order.store(true);
  return stop_requested;
}

}  // namespace gdfmap::cli
