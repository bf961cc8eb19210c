#include "output.hpp"

#include <cerrno>
#include <string>
#include <system_error>

#include <nlohmann/json.hpp>
#include <unistd.h>

#include <gdfmap/core/error.hpp>

namespace gdfmap::cli {
namespace {

/// Writes all of it; false when the system refuses, with errno set.
bool write_all(int descriptor, std::string_view text) noexcept {
  while (!text.empty()) {
    const ssize_t count = ::write(descriptor, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

}  // namespace

void write_output(std::string_view text) {
  if (write_all(STDOUT_FILENO, text)) return;
  if (errno == EPIPE) throw ClosedPipe();
  throw Error(ErrorCode::kIo,
              "cannot write to standard output: " + std::generic_category().message(errno));
}

std::string json_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

void write_message(std::string_view text) noexcept { write_all(STDERR_FILENO, text); }

}  // namespace gdfmap::cli
