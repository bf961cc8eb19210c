#pragma once

#include <bit>
#include <cstddef>
#include <cstring>

#include <gdfmap/core/bytes.hpp>

namespace gdfmap::io {

/// Writes a little-endian number at any address.
template <WireNumber T>
void store(std::byte* to, T value) {
  if constexpr (std::endian::native != std::endian::little) value = detail::swap_bytes(value);
  std::memcpy(to, &value, sizeof(T));
}

/// Points that writers encode at a time.
inline constexpr std::size_t kWriterBlockPoints = 4096;

}  // namespace gdfmap::io
