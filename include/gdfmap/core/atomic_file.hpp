#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string_view>

namespace gdfmap {

/// A file that appears under its name complete or not at all: written beside it under a temporary
/// name, renamed by commit(). Destroyed without commit() it leaves nothing. Not thread-safe.
/// @throws Error kIo (path and system message) from every member that writes.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(std::span<const std::byte> bytes);
  void write(std::string_view text);
  /// Overwrites earlier bytes; later write() calls append again.
  void write_at(std::uint64_t offset, std::span<const std::byte> bytes);
  /// Flushes to the disk and renames.
  void commit();

  /// Where the bytes are until commit(), for libraries that write to a name of their own.
  [[nodiscard]] const std::filesystem::path& temporary_path() const { return temporary_; }

 private:
  [[noreturn]] void fail(const char* action) const;

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  std::FILE* file_ = nullptr;
};

}  // namespace gdfmap
