#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <gdfmap/core/hash.hpp>

namespace gdfmap::io {

/// The bytes of a file, a pipe or standard input ("-"), read once from front to back through one
/// buffer and hashed on the way. Not thread-safe.
/// @throws Error kIo (path and system message) from every member that reads.
class InputFile {
 public:
  /// The most that peek() and take() can be asked for.
  static constexpr std::size_t kMaxPeekBytes = std::size_t{1} << 19;

  explicit InputFile(const std::filesystem::path& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// How messages call it: the path, or "standard input".
  [[nodiscard]] const std::string& name() const { return name_; }
  /// A regular file: its size is known and read_at() works.
  [[nodiscard]] bool is_regular() const { return size_.has_value(); }
  /// Bytes between position() and the end; empty when that cannot be known.
  [[nodiscard]] std::optional<std::uint64_t> bytes_left() const;
  [[nodiscard]] std::uint64_t position() const { return num_read_ - (end_ - begin_); }

  /// All buffered bytes from position() on: at least min_bytes (≤ kMaxPeekBytes) unless the file
  /// ends before. Valid until the next call that is not const.
  [[nodiscard]] std::span<const std::byte> peek(std::size_t min_bytes) {
    if (end_ - begin_ < min_bytes) fill(min_bytes);
    return {buffer_.get() + begin_, end_ - begin_};
  }
  /// Moves past bytes that peek() has shown.
  void consume(std::size_t count) { begin_ += count; }
  /// The next `count` bytes (≤ kMaxPeekBytes), consumed; null when the file ends before.
  [[nodiscard]] const std::byte* take(std::size_t count) {
    if (peek(count).size() < count) return nullptr;
    begin_ += count;
    return buffer_.get() + begin_ - count;
  }
  /// Moves on by `count` bytes; false when the file ends before.
  [[nodiscard]] bool skip(std::uint64_t count);

  /// Bytes at any offset of a regular file, beside the stream; returns how many there were.
  [[nodiscard]] std::size_t read_at(std::uint64_t offset, std::span<std::byte> to) const;

  /// Reads what is left; XXH3-128 of all bytes.
  [[nodiscard]] Digest finish();
  /// Bytes read so far; those of the whole file after finish().
  [[nodiscard]] std::uint64_t num_read() const { return num_read_; }

  /// @throws Error kCorrupt "<name>: <what>".
  [[noreturn]] void fail(const std::string& what) const;

 private:
  void fill(std::size_t min_bytes);
  void grow();
  [[noreturn]] void fail_reading() const;

  std::string name_;
  int descriptor_ = -1;
  bool owned_ = false;
  std::optional<std::uint64_t> size_;
  std::unique_ptr<std::byte[]> buffer_;
  std::size_t capacity_ = 0;
  std::size_t begin_ = 0;  ///< buffer_[begin_, end_) is read from the file and not consumed
  std::size_t end_ = 0;
  std::uint64_t num_read_ = 0;
  StreamHasher hasher_;
};

/// @throws Error kCorrupt with the numbers when `count` records of at least `bytes_each` bytes
/// cannot
///         be in what is left of the file; never for streams, whose end shows itself when reached.
void require_bytes(const InputFile& file, std::uint64_t count, std::uint64_t bytes_each,
                   const std::string& records);

}  // namespace gdfmap::io
