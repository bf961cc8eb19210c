#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/core/hilbert.hpp>

namespace gdfmap {
namespace {

using Cell = std::array<std::uint32_t, 3>;

/// Every cell of the grid at the place of its code; empty when two have the same or one is too
/// large.
std::vector<Cell> curve(int num_bits) {
  const std::uint32_t side = 1u << num_bits;
  std::vector<Cell> cells(side * side * side);
  std::vector<bool> taken(cells.size());
  for (std::uint32_t x = 0; x < side; ++x) {
    for (std::uint32_t y = 0; y < side; ++y) {
      for (std::uint32_t z = 0; z < side; ++z) {
        const std::uint64_t code = hilbert_code({x, y, z}, num_bits);
        if (code >= cells.size() || taken[code]) return {};
        taken[code] = true;
        cells[code] = {x, y, z};
      }
    }
  }
  return cells;
}

TEST(Hilbert, VisitsEveryCellOnceAndGoesFromFaceToFace) {
  for (const int num_bits : {1, 2, 3, 5}) {
    const std::vector<Cell> cells = curve(num_bits);
    ASSERT_FALSE(cells.empty()) << num_bits;
    for (std::size_t i = 1; i < cells.size(); ++i) {
      int steps = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        steps += std::abs(static_cast<int>(cells[i][a]) - static_cast<int>(cells[i - 1][a]));
      }
      ASSERT_EQ(steps, 1) << num_bits << " bits, cell " << i;
    }
  }
}

TEST(Hilbert, LeavesNoOctantBeforeAllOfItIsVisited) {
  constexpr int kBits = 4;
  const std::vector<Cell> cells = curve(kBits);
  ASSERT_FALSE(cells.empty());
  for (std::uint32_t shift = 1; shift < kBits; ++shift) {
    const std::size_t octant = std::size_t{1} << (3 * shift);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      for (std::size_t a = 0; a < 3; ++a) {
        ASSERT_EQ(cells[i][a] >> shift, cells[i / octant * octant][a] >> shift);
      }
    }
  }
}

TEST(Hilbert, TakesTheWholeRange) {
  constexpr int kBits = 21;
  constexpr std::uint32_t kLast = (1u << kBits) - 1;
  EXPECT_EQ(hilbert_code({0, 0, 0}, kBits), 0u);
  std::uint64_t highest = 0;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const auto at = [&](std::uint32_t a) { return (corner >> a & 1u) * kLast; };
    highest = std::max(highest, hilbert_code({at(0), at(1), at(2)}, kBits));
  }
  EXPECT_EQ(highest, (std::uint64_t{1} << (3 * kBits)) - 1);  // the curve ends in a corner
}

}  // namespace
}  // namespace gdfmap
