#pragma once

#include <atomic>

namespace gdfmap::cli {

/// From now on SIGINT and SIGTERM end the program at once with the exit code for interrupted, and a
/// closed pipe is an error of the write instead of a signal.
void install_signal_handlers();

/// From now on the first SIGINT or SIGTERM only raises the flag that is returned, so that the work
/// can end in good order; a second one ends the program at once.
const std::atomic<bool>& watch_for_stop();

}  // namespace gdfmap::cli
