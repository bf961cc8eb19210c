#include "lzf_stream.hpp"

#include <algorithm>
#include <cstring>

namespace gdfmap::io {
namespace {

constexpr std::size_t kHistoryBytes = 8192;
constexpr std::size_t kMaxRunBytes = 264;  ///< the most that one command produces

/// Runs are short: copying whole chunks, up to kChunkBytes - 1 bytes too many, is cheaper than a
/// call for the exact length.
constexpr std::size_t kChunkBytes = 16;

/// `from` and `to` are at least kChunkBytes apart, or do not overlap.
void copy_chunks(std::byte* to, const std::byte* from, std::size_t length) {
  for (std::size_t i = 0; i < length; i += kChunkBytes) std::memcpy(to + i, from + i, kChunkBytes);
}

/// Goes forwards where source and target overlap: that is how LZF repeats a pattern.
void copy_back_reference(std::byte* to, std::size_t distance, std::size_t length) {
  const std::byte* const from = to - distance;
  if (distance >= kChunkBytes) {
    copy_chunks(to, from, length);
  } else {
    for (std::size_t i = 0; i < length; ++i) to[i] = from[i];
  }
}

}  // namespace

LzfDecoder::LzfDecoder() : window_(kHistoryBytes + kMaxOutputBytes + kChunkBytes) {}

std::optional<std::size_t> LzfDecoder::decode(std::span<const std::byte> input) {
  keep_history();
  std::size_t used = 0;
  while (used < input.size() && end_ + kMaxRunBytes <= kHistoryBytes + kMaxOutputBytes) {
    const auto control = std::to_integer<std::size_t>(input[used]);
    if (control < 32) {
      const std::size_t length = control + 1;
      if (input.size() - used < 1 + length) break;
      const std::byte* const from = input.data() + used + 1;
      if (input.size() - used > 2 * kChunkBytes) {
        copy_chunks(window_.data() + end_, from, length);
      } else {
        std::memcpy(window_.data() + end_, from, length);
      }
      end_ += length;
      used += 1 + length;
      continue;
    }
    const bool is_long = control >> 5 == 7;
    const std::size_t command_bytes = is_long ? 3 : 2;
    if (input.size() - used < command_bytes) break;
    const std::size_t extra = is_long ? std::to_integer<std::size_t>(input[used + 1]) : 0;
    const std::size_t length = (control >> 5) + extra + 2;
    const std::size_t distance =
        ((control & 31) << 8) + std::to_integer<std::size_t>(input[used + command_bytes - 1]) + 1;
    if (distance > end_) return std::nullopt;
    copy_back_reference(window_.data() + end_, distance, length);
    end_ += length;
    used += command_bytes;
  }
  num_produced_ += end_ - begin_;
  return used;
}

void LzfDecoder::keep_history() {
  const std::size_t kept = std::min(end_, kHistoryBytes);
  std::memmove(window_.data(), window_.data() + end_ - kept, kept);
  begin_ = end_ = kept;
}

}  // namespace gdfmap::io
