#pragma once

#include <stdexcept>
#include <string>

namespace gdfmap {

/// Why an operation could not keep its promise. The values are the exit codes of the program.
enum class ErrorCode {
  kInternal = 1,     ///< a defect of gdfmap itself
  kUsage = 2,        ///< an argument or a configuration that cannot be used
  kIo = 3,           ///< the system refused: missing file, no permission, full disk, busy map
  kCorrupt = 4,      ///< bytes that are damaged, or of a version that this build does not read
  kInterrupted = 5,  ///< stopped on request; nothing is lost, run it again
  kCondition = 6,    ///< finished, but a condition that the caller set was not met
};

/// The one exception type of the library. The message says what was wrong and where (path, record,
/// key), in one line, without a trailing full stop.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}

  [[nodiscard]] ErrorCode code() const noexcept { return code_; }

 private:
  ErrorCode code_;
};

}  // namespace gdfmap
