#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>

namespace gdfmap {

/// How far a long operation has come. `total` is 0 where it cannot be known.
struct Progress {
  const char* stage = "";  ///< what is counted: "points", "tiles", "cubes"
  std::uint64_t done = 0;
  std::uint64_t total = 0;
  std::string detail;      ///< further figures for people, may be empty
  double fraction = -1.0;  ///< of the work that is done, where `total` is 0; negative: not known
};

enum class Severity { kInfo, kWarning };

/// Receives what a long operation reports; the library itself never prints. Called from one thread
/// at a time; implementations return quickly and do not throw.
class ReportSink {
 public:
  virtual ~ReportSink() = default;
  virtual void on_progress(const Progress& progress) = 0;
  virtual void on_message(Severity severity, const std::string& message) = 0;
};

/// How a long operation runs. None of it changes a result.
struct RunContext {
  int num_threads = 0;           ///< 0: one per core
  std::size_t memory_bytes = 0;  ///< budget of the whole process; 0: default_memory_bytes()
  ReportSink* sink = nullptr;    ///< not owned; may be null
  const std::atomic<bool>* stop = nullptr;  ///< not owned; true asks the operation to end soon

  [[nodiscard]] bool stop_requested() const { return stop != nullptr && stop->load(); }
  /// @throws Error kInterrupted when a stop is requested.
  void throw_if_stopped() const;
  [[nodiscard]] int threads() const;
  [[nodiscard]] std::size_t memory() const;

  void progress(const Progress& p) const {
    if (sink != nullptr) sink->on_progress(p);
  }
  void info(const std::string& message) const {
    if (sink != nullptr) sink->on_message(Severity::kInfo, message);
  }
  void warn(const std::string& message) const {
    if (sink != nullptr) sink->on_message(Severity::kWarning, message);
  }
};

inline constexpr std::size_t kMinMemoryBytes = std::size_t{64} << 20;

/// A quarter of the machine's memory, at most 4 GiB, at least kMinMemoryBytes.
[[nodiscard]] std::size_t default_memory_bytes();

}  // namespace gdfmap
