#pragma once

#include <cstdint>

namespace gdfmap {

/// Spreads the low 21 bits of v so that two zero bits follow each.
[[nodiscard]] constexpr std::uint64_t spread_bits(std::uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x1f00000000ffff;
  v = (v | v << 16) & 0x1f0000ff0000ff;
  v = (v | v << 8) & 0x100f00f00f00f00f;
  v = (v | v << 4) & 0x10c30c30c30c30c3;
  v = (v | v << 2) & 0x1249249249249249;
  return v;
}

/// The inverse of spread_bits: gathers every third bit, from the lowest on.
[[nodiscard]] constexpr std::uint64_t gather_bits(std::uint64_t v) {
  v &= 0x1249249249249249;
  v = (v | v >> 2) & 0x10c30c30c30c30c3;
  v = (v | v >> 4) & 0x100f00f00f00f00f;
  v = (v | v >> 8) & 0x1f0000ff0000ff;
  v = (v | v >> 16) & 0x1f00000000ffff;
  return (v | v >> 32) & 0x1fffff;
}

/// Interleaves the low 21 bits of each coordinate, x in the lowest place.
[[nodiscard]] constexpr std::uint64_t morton_code(std::uint64_t x, std::uint64_t y,
                                                  std::uint64_t z) {
  return spread_bits(x) | spread_bits(y) << 1 | spread_bits(z) << 2;
}

/// Compares two triples of signed coordinates in Morton order without forming a code, so that any
/// 64-bit range fits: the axis whose coordinates differ in the highest bit decides (T. Chan, 2002,
/// "Closest-point problems simplified on the RAM"). Signed order is kept by flipping the sign bit.
[[nodiscard]] constexpr bool morton_less(const std::int64_t (&a)[3], const std::int64_t (&b)[3]) {
  int axis = 2;
  std::uint64_t highest = 0;
  for (int i = 2; i >= 0; --i) {
    const std::uint64_t difference = static_cast<std::uint64_t>(a[i] ^ b[i]);
    if (highest < difference && highest < (highest ^ difference)) {
      highest = difference;
      axis = i;
    }
  }
  return a[axis] < b[axis];
}

/// The same of keys with coordinates x, y and z.
template <typename Key>
[[nodiscard]] constexpr bool in_morton_order(const Key& a, const Key& b) {
  return morton_less({a.x, a.y, a.z}, {b.x, b.y, b.z});
}

}  // namespace gdfmap
