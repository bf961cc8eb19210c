#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/hash.hpp>

namespace gdfmap {

using Bytes = std::vector<std::byte>;

/// Numbers of fixed size, as they stand in files.
template <typename T>
concept WireNumber = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;

namespace detail {
template <typename T>
[[nodiscard]] T swap_bytes(T value) {
  std::byte raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(raw[i], raw[sizeof(T) - 1 - i]);
  std::memcpy(&value, raw, sizeof(T));
  return value;
}
}  // namespace detail

/// Reads a number at any address (no alignment needed) in the given byte order.
template <WireNumber T>
[[nodiscard]] T load(const std::byte* from, std::endian order = std::endian::little) {
  T value;
  std::memcpy(&value, from, sizeof(T));
  return order == std::endian::native ? value : detail::swap_bytes(value);
}

/// Writes a little-endian number at any address.
template <WireNumber T>
void store(std::byte* to, T value) {
  if constexpr (std::endian::native != std::endian::little) value = detail::swap_bytes(value);
  std::memcpy(to, &value, sizeof(T));
}

/// Appends little-endian fields to a buffer.
class ByteWriter {
 public:
  template <WireNumber T>
  void put(T value) {
    if constexpr (std::endian::native != std::endian::little) value = detail::swap_bytes(value);
    put_bytes(std::as_bytes(std::span<const T, 1>(&value, 1)));
  }
  void put(const Digest& digest) {
    put(digest.low);
    put(digest.high);
  }
  /// Number by number.
  template <WireNumber T>
  void put(std::span<const T> values) {
    if constexpr (std::endian::native == std::endian::little) {
      put_bytes(std::as_bytes(values));
    } else {
      for (const T value : values) put(value);
    }
  }
  void put_bytes(std::span<const std::byte> bytes) {
    // Not insert(): g++ 12 warns of an overflow in it that is none.
    const std::size_t size = bytes_.size();
    bytes_.resize(size + bytes.size());
    if (!bytes.empty()) std::memcpy(bytes_.data() + size, bytes.data(), bytes.size());
  }

  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }
  [[nodiscard]] Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
};

/// Reads little-endian fields from a buffer that outlives it. Every read is checked: reading past
/// the end throws Error kCorrupt, "<what>: truncated".
class ByteReader {
 public:
  ByteReader(std::span<const std::byte> bytes, std::string what)
      : bytes_(bytes), what_(std::move(what)) {}

  template <WireNumber T>
  [[nodiscard]] T get() {
    return load<T>(get_bytes(sizeof(T)).data());
  }
  [[nodiscard]] Digest get_digest() {
    const auto low = get<std::uint64_t>();
    return Digest{low, get<std::uint64_t>()};
  }
  [[nodiscard]] std::span<const std::byte> get_bytes(std::size_t count) {
    if (count > remaining()) throw Error(ErrorCode::kCorrupt, what_ + ": truncated");
    const auto result = bytes_.subspan(position_, count);
    position_ += count;
    return result;
  }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - position_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
  std::string what_;
};

}  // namespace gdfmap
