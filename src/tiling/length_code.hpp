#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include <gdfmap/core/bytes.hpp>

namespace gdfmap {

/// Numbers of 16 bits as a prefix code of their length in bits and the bits below the highest one,
/// which is what schema/block_format.md calls a stream.
inline constexpr int kNumLengths = 17;                   ///< lengths 0 (of the number 0) to 16
inline constexpr int kMaxCodeBits = 8;                   ///< of a length's code word
using CodeBits = std::array<std::uint8_t, kNumLengths>;  ///< of each length; 0: it does not occur

/// Bits of the code words of an optimal prefix code for these numbers, none above kMaxCodeBits.
/// Where all are of one length, that has 1 here, but its code word takes no room.
[[nodiscard]] CodeBits code_bits_for(std::span<const std::uint16_t> numbers);

/// Appends the numbers as a stream, padded with zero bits to whole bytes. `code_bits` are theirs.
void put_stream(std::span<const std::uint16_t> numbers, const CodeBits& code_bits, Bytes& bytes);

/// Reads a stream number by number. Reading past the end is safe and seen by ends_at().
class StreamReader {
 public:
  /// Bytes behind a stream that must be readable, whatever they hold.
  static constexpr std::size_t kPadding = 8;

  /// Empty where no prefix code has these bits. `begin` outlives the reader.
  [[nodiscard]] static std::optional<StreamReader> open(const std::byte* begin,
                                                        std::size_t num_bytes,
                                                        const CodeBits& code_bits);

  [[nodiscard]] std::uint16_t next() {
    const std::uint64_t byte = position_ >> 3;
    const std::uint64_t bits =
        load<std::uint64_t>(begin_ + (byte < num_bytes_ ? byte : num_bytes_)) >> (position_ & 7);
    const Entry& entry = table_[bits & (table_.size() - 1)];
    position_ += entry.total_bits;
    return static_cast<std::uint16_t>(entry.highest_bit |
                                      (bits >> entry.code_bits & entry.lower_mask));
  }
  /// Whether exactly the whole stream was read, and its padding is zero.
  [[nodiscard]] bool is_at_end() const;

 private:
  struct Entry {
    std::uint8_t code_bits = 0, total_bits = 0;
    std::uint16_t highest_bit = 0, lower_mask = 0;
  };

  const std::byte* begin_ = nullptr;
  std::uint64_t num_bytes_ = 0;
  std::uint64_t position_ = 0;  // in bits
  std::array<Entry, std::size_t{1} << kMaxCodeBits> table_;
};

}  // namespace gdfmap
