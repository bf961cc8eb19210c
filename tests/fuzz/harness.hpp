#pragma once

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <initializer_list>

#include <gdfmap/core/error.hpp>

#include "targets.hpp"

namespace gdfmap::fuzz {

/// A promise of the code under test: libFuzzer keeps the input that breaks one.
inline void require(bool kept, const char* promise) {
  if (kept) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

/// Runs `read`; whether it accepted its input. It may refuse with these codes and one line, and
/// with nothing else.
template <typename Read>
bool accepts(std::initializer_list<ErrorCode> refusals, const Read& read) {
  try {
    read();
    return true;
  } catch (const Error& error) {
    bool documented = false;
    for (const ErrorCode code : refusals) documented |= code == error.code();
    if (!documented) std::fprintf(stderr, "refused with: %s\n", error.what());
    require(documented, "a refusal has a documented code");
    return false;
  }
}

/// A regular file in memory under a name of its own, so that readers of files can be fuzzed
/// without a disk. Filled again for every input.
class MemoryFile {
 public:
  /// @param extension  of the name, with its dot
  explicit MemoryFile(const char* extension);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  const std::filesystem::path& hold(Input bytes);

 private:
  int descriptor_;
  std::filesystem::path directory_, path_;
};

}  // namespace gdfmap::fuzz
