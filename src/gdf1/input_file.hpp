#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace gdfmap::gdf1 {

/// A regular file read from front to back, which knows how much is left of it. Not thread-safe.
/// @throws Error kIo when the system refuses, kCorrupt when the file ends too soon.
class InputFile {
 public:
  explicit InputFile(std::filesystem::path path);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Bytes that read() and skip() have not passed yet; lines are not counted.
  [[nodiscard]] std::uint64_t remaining() const { return remaining_; }

  /// Fills `bytes`. @param place  what is being read, for the message: "cube 3 of 20"
  void read(std::span<std::byte> bytes, const std::string& place);
  /// Moves forward, at most to the end.
  void skip(std::uint64_t num_bytes);
  /// The next line without its line break (LF or CR LF), valid until the next call; false at the
  /// end.
  /// @throws Error kCorrupt for a line that is longer than any line of a model.
  [[nodiscard]] bool read_line(std::string_view& line);
  /// Of the line that read_line() gave last, counted from 1.
  [[nodiscard]] std::uint64_t line_number() const { return line_number_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  [[noreturn]] void fail_reading() const;

  std::filesystem::path path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t remaining_ = 0;
  std::uint64_t line_number_ = 0;
  std::string line_;
};

}  // namespace gdfmap::gdf1
