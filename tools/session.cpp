#include "session.hpp"

#include <nlohmann/json.hpp>
#include <unistd.h>

#include <gdfmap/core/error.hpp>

#include "output.hpp"
#include "signals.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

ProgressStyle progress_style(const CommonOptions& options) {
  if (options.quiet || options.progress == "none") return ProgressStyle::kNone;
  if (options.progress == "json") return ProgressStyle::kJson;
  return ::isatty(STDERR_FILENO) == 1 ? ProgressStyle::kTerminal : ProgressStyle::kLog;
}

std::size_t memory_budget(const std::string& text) {
  if (text.empty()) return 0;
  const std::size_t bytes = parse_size(text, "--memory");
  if (bytes < kMinMemoryBytes) {
    throw Error(ErrorCode::kUsage,
                "--memory: " + text + " is below the least, " + byte_text(kMinMemoryBytes));
  }
  return bytes;
}

}  // namespace

Session::Session(const CommonOptions& options, OnSignal on_signal)
    : printer_("gdfmap " + options.command, progress_style(options), options.quiet),
      json_(options.json) {
  context_.num_threads = options.num_threads;
  context_.memory_bytes = memory_budget(options.memory);
  context_.sink = &printer_;
  if (on_signal == OnSignal::kStop) context_.stop = &watch_for_stop();
}

double Session::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

void Session::print(std::string_view text) {
  printer_.clear();
  write_output(text);
}

void Session::print_json(const nlohmann::ordered_json& json) { print(json_text(json)); }

}  // namespace gdfmap::cli
