#pragma once

#include <filesystem>

namespace gdfmap {

/// An exclusive lock held through an open file (flock): a killed process leaves none behind.
class FileLock {
 public:
  /// @throws Error kIo when another process holds it (the message names it) or the file cannot be
  /// made.
  explicit FileLock(const std::filesystem::path& path);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  int descriptor_ = -1;
};

}  // namespace gdfmap
