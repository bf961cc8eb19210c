#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include <gdfmap/core/run_context.hpp>

namespace gdfmap::cli {

enum class ProgressStyle {
  kNone,
  kTerminal,  ///< one line that is rewritten
  kLog,       ///< a line every ten seconds
  kJson,      ///< one JSON object a line
};

/// Prints progress and messages on standard error. Not thread-safe.
class ProgressPrinter : public ReportSink {
 public:
  /// @param prefix  what messages start with, "gdfmap train"
  /// @param quiet   prints warnings alone
  ProgressPrinter(std::string prefix, ProgressStyle style, bool quiet);
  ~ProgressPrinter() override { clear(); }

  void on_progress(const Progress& progress) override;
  void on_message(Severity severity, const std::string& message) override;

  /// Removes the rewritten line, before something else is printed.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  /// What is known of the pace of a stage.
  struct Pace {
    double rate = 0.0;     ///< per second; 0: not known yet
    double seconds = 0.0;  ///< left; negative: not known
  };

  void start_stage(const Progress& progress);
  [[nodiscard]] bool is_due(const Progress& progress) const;
  [[nodiscard]] Pace pace(const Progress& progress) const;
  [[nodiscard]] std::string line(const Progress& progress) const;
  [[nodiscard]] std::string json_line(const Progress& progress) const;

  std::string prefix_;
  ProgressStyle style_;
  bool quiet_;
  bool line_is_open_ = false;
  std::string stage_;
  std::uint64_t first_done_ = 0;
  std::uint64_t last_done_ = 0;
  bool printed_in_stage_ = false;
  Clock::time_point stage_start_;
  Clock::time_point last_print_;
};

}  // namespace gdfmap::cli
