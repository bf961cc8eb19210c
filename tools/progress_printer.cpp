#include "progress_printer.hpp"

#include <fstream>
#include <utility>

#include <nlohmann/json.hpp>
#include <unistd.h>

#include "output.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr std::chrono::milliseconds kTerminalInterval{100};
constexpr std::chrono::milliseconds kJsonInterval{200};
constexpr std::chrono::seconds kLogInterval{10};
constexpr double kMinPaceSeconds = 0.5;  ///< before that a rate says nothing

/// Resident memory of this process; 0 where the system does not tell.
std::uint64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t total = 0, resident = 0;
  statm >> total >> resident;
  return statm ? resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) : 0;
}

double seconds_between(auto from, auto to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

ProgressPrinter::ProgressPrinter(std::string prefix, ProgressStyle style, bool quiet)
    : prefix_(std::move(prefix)), style_(style), quiet_(quiet) {}

void ProgressPrinter::on_progress(const Progress& progress) {
  if (style_ == ProgressStyle::kNone) return;
  if (stage_ != progress.stage || progress.done < last_done_) start_stage(progress);
  last_done_ = progress.done;
  if (!is_due(progress)) return;
  printed_in_stage_ = true;
  last_print_ = Clock::now();
  if (style_ == ProgressStyle::kJson) {
    write_message(json_line(progress));
  } else if (style_ == ProgressStyle::kLog) {
    write_message(line(progress) + "\n");
  } else {
    write_message("\r\033[K" + line(progress));
    line_is_open_ = true;
  }
}

void ProgressPrinter::on_message(Severity severity, const std::string& message) {
  const bool warning = severity == Severity::kWarning;
  if (quiet_ && !warning) return;
  if (style_ == ProgressStyle::kJson) {
    const nlohmann::ordered_json json = {{"severity", warning ? "warning" : "info"},
                                         {"message", message}};
    write_message(json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    return;
  }
  clear();
  write_message(prefix_ + (warning ? ": warning: " : ": ") + message + "\n");
}

void ProgressPrinter::clear() {
  if (!line_is_open_) return;
  write_message("\r\033[K");
  line_is_open_ = false;
}

void ProgressPrinter::start_stage(const Progress& progress) {
  stage_ = progress.stage;
  first_done_ = progress.done;
  printed_in_stage_ = false;
  stage_start_ = Clock::now();
  last_print_ = stage_start_;
}

bool ProgressPrinter::is_due(const Progress& progress) const {
  const auto elapsed = Clock::now() - last_print_;
  if (style_ == ProgressStyle::kLog) return elapsed >= kLogInterval;
  const bool complete = progress.total > 0 && progress.done >= progress.total;
  if (!printed_in_stage_ || complete) return true;
  return elapsed >= (style_ == ProgressStyle::kJson ? kJsonInterval : kTerminalInterval);
}

ProgressPrinter::Pace ProgressPrinter::pace(const Progress& progress) const {
  Pace pace{0.0, -1.0};
  const double elapsed = seconds_between(stage_start_, Clock::now());
  if (elapsed < kMinPaceSeconds || progress.done <= first_done_) return pace;
  pace.rate = static_cast<double>(progress.done - first_done_) / elapsed;
  if (progress.total >= progress.done) {
    pace.seconds = static_cast<double>(progress.total - progress.done) / pace.rate;
  } else if (progress.total == 0 && progress.fraction > 0.0) {
    pace.seconds = elapsed * (1.0 - progress.fraction) / progress.fraction;
  }
  return pace;
}

std::string ProgressPrinter::line(const Progress& progress) const {
  std::string text = prefix_ + ": " + grouped(progress.done);
  if (progress.total > 0) text += " of " + grouped(progress.total);
  text += std::string(" ") + progress.stage;
  if (progress.total == 0 && progress.fraction >= 0.0) {
    text += " (" + fixed(100.0 * progress.fraction, 0) + " %)";
  }
  if (!progress.detail.empty()) text += ", " + progress.detail;
  const Pace known = pace(progress);
  if (known.rate > 0.0) text += ", " + rounded(known.rate, 3) + " " + progress.stage + "/s";
  if (known.seconds >= 0.0) text += ", " + duration_text(known.seconds) + " left";
  return text + ", " + byte_text(resident_bytes());
}

std::string ProgressPrinter::json_line(const Progress& progress) const {
  const Pace known = pace(progress);
  nlohmann::ordered_json json = {{"stage", progress.stage}, {"done", progress.done}};
  json["total"] = progress.total > 0 ? nlohmann::ordered_json(progress.total) : nullptr;
  const double share =
      progress.total > 0 ? static_cast<double>(progress.done) / static_cast<double>(progress.total)
                         : progress.fraction;
  json["fraction"] = share >= 0.0 ? nlohmann::ordered_json(share) : nullptr;
  json["rate"] = known.rate > 0.0 ? nlohmann::ordered_json(known.rate) : nullptr;
  json["eta_seconds"] = known.seconds >= 0.0 ? nlohmann::ordered_json(known.seconds) : nullptr;
  json["resident_bytes"] = resident_bytes();
  json["detail"] = progress.detail;
  return json.dump() + "\n";
}

}  // namespace gdfmap::cli
