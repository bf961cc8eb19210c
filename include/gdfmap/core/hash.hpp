#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace gdfmap {

/// A 128-bit digest, also an element of the additive group modulo 2¹²⁸, so that a digest of a set
/// is the sum of the digests of its elements, in any order.
struct Digest {
  std::uint64_t low = 0, high = 0;

  Digest& operator+=(const Digest& other) {
    const std::uint64_t sum = low + other.low;
    high += other.high + (sum < low ? 1 : 0);
    low = sum;
    return *this;
  }
  auto operator<=>(const Digest&) const = default;

  /// 32 lower-case hexadecimal digits, high half first.
  [[nodiscard]] std::string hex() const;
  [[nodiscard]] static std::optional<Digest> from_hex(std::string_view text);
};

/// XXH3-128 and XXH3-64 with seed 0 (github.com/Cyan4973/xxHash).
[[nodiscard]] Digest hash128(std::span<const std::byte> bytes);
[[nodiscard]] std::uint64_t hash64(std::span<const std::byte> bytes);

/// XXH3-128 over bytes that arrive in pieces.
class StreamHasher {
 public:
  StreamHasher();
  ~StreamHasher();
  StreamHasher(StreamHasher&&) noexcept;
  StreamHasher& operator=(StreamHasher&&) noexcept;

  void update(std::span<const std::byte> bytes);
  [[nodiscard]] Digest digest() const;  ///< of what has been fed so far

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gdfmap
