#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <gdfmap/core/bytes.hpp>

namespace gdfmap::io {

/// Decompresses LZF (M. Lehmann's liblzf format, as PCD binary_compressed holds it) piece by piece.
/// References look back 8192 bytes at most, so a short window is all that it keeps. A copy goes on
/// from the same place by itself.
class LzfDecoder {
 public:
  static constexpr std::size_t kMaxCommandBytes = 33;        ///< a literal run of 32
  static constexpr std::size_t kMaxOutputBytes = 33 * 1024;  ///< of one decode()

  LzfDecoder();

  /// Executes whole commands from the front of `input` until it or the output buffer is used up;
  /// returns the bytes consumed. 0 for an input that is not empty: it ends inside a command. Empty:
  /// a reference points before the first byte.
  [[nodiscard]] std::optional<std::size_t> decode(std::span<const std::byte> input);

  /// What the last decode() produced; valid until the next.
  [[nodiscard]] std::span<const std::byte> output() const {
    return {window_.data() + begin_, end_ - begin_};
  }
  /// Bytes produced by all calls.
  [[nodiscard]] std::uint64_t num_produced() const { return num_produced_; }

 private:
  void keep_history();

  Bytes window_;
  std::size_t begin_ = 0;  ///< window_[0, begin_) is history, [begin_, end_) the last output
  std::size_t end_ = 0;
  std::uint64_t num_produced_ = 0;
};

}  // namespace gdfmap::io
