#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace gdfmap::test {

/// How a program ended.
struct Result {
  int exit_code = -1;  ///< −1 when a signal ended it
  int signal = 0;      ///< that signal, else 0
  std::string out, err;
};

/// How a program is started.
struct Launch {
  std::string program;
  std::vector<std::string> arguments;
  std::string input;                                             ///< on standard input
  std::vector<std::pair<std::string, std::string>> environment;  ///< added to the test's own
  /// Closes standard output after this many bytes have been read of it.
  std::optional<std::size_t> read_at_most;
  /// As the user nobody; the caller must be root.
  bool unprivileged = false;
  /// Kills it with SIGKILL after this time, unless it has ended by itself.
  std::optional<std::chrono::microseconds> kill_after;
};
[[nodiscard]] Result run(const Launch& launch);

/// The program `gdfmap` with these arguments.
[[nodiscard]] Result gdfmap(std::vector<std::string> arguments, std::string input = {});

/// The same program built with failpoints, which ends at one of them.
/// @param failpoint  NAME:COUNT[:TERM[:TIMES]]: raises SIGKILL, or SIGTERM that many times, when
/// the
///                   program passes NAME for the COUNT-th time
[[nodiscard]] Result gdfmap_until(const std::string& failpoint, std::vector<std::string> arguments);

}  // namespace gdfmap::test
