#pragma once

#include <array>
#include <cstdint>

#include <gdfmap/core/morton.hpp>

namespace gdfmap {

/// Place along the Hilbert curve through a grid of 2ⁿ cells an axis: cells with successive codes
/// share a face, so that a run of them keeps closer together than a run in Morton order. After
/// J. Skilling, "Programming the Hilbert curve", AIP Conf. Proc. 707, 2004.
/// @param cell      coordinates below 2ⁿ
/// @param num_bits  n, at most 21
[[nodiscard]] constexpr std::uint64_t hilbert_code(std::array<std::uint32_t, 3> cell,
                                                   int num_bits) {
  // From the coarsest half down: what the curve's turns do to the finer bits is undone.
  for (int bit = num_bits - 1; bit > 0; --bit) {
    const std::uint32_t finer = (1u << bit) - 1;
    for (std::uint32_t& coordinate : cell) {
      const std::uint32_t is_upper = 0u - (coordinate >> bit & 1u);  // all bits or none
      const std::uint32_t exchanged = (cell[0] ^ coordinate) & finer & ~is_upper;
      cell[0] ^= exchanged | (finer & is_upper);
      coordinate ^= exchanged;
    }
  }
  // What is left are the digits of the code in Gray's order.
  cell[1] ^= cell[0];
  cell[2] ^= cell[1];
  std::uint32_t parity = cell[2] >> 1;  // of all higher bits
  for (int shift = 1; shift < 32; shift *= 2) parity ^= parity >> shift;
  for (std::uint32_t& coordinate : cell) coordinate ^= parity;
  return morton_code(cell[2], cell[1], cell[0]);
}

}  // namespace gdfmap
