#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include <gdfmap/core/run_context.hpp>

#include "options.hpp"
#include "progress_printer.hpp"

namespace gdfmap::cli {

/// What SIGINT and SIGTERM do to a subcommand.
enum class OnSignal {
  kEnd,   ///< end at once: it only reads
  kStop,  ///< ask it to end in good order: it writes, or has temporary files
};

/// One run of a subcommand: its context, its messages and its results.
class Session {
 public:
  /// @throws Error kUsage for a memory budget that cannot be used
  Session(const CommonOptions& options, OnSignal on_signal);

  [[nodiscard]] const RunContext& context() const { return context_; }
  [[nodiscard]] bool json() const { return json_; }
  [[nodiscard]] double seconds() const;  ///< since the session began

  /// Results, on standard output. @throws ClosedPipe, Error kIo
  void print(std::string_view text);
  void print_json(const nlohmann::ordered_json& json);

 private:
  ProgressPrinter printer_;
  RunContext context_;
  bool json_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace gdfmap::cli
