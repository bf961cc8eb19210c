#include "locality_order.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include <gdfmap/core/morton.hpp>

namespace gdfmap {
namespace {

/// An entry is a code above the index of its point.
constexpr int kIndexBits = 20;
constexpr int kCodeBits = 64 - kIndexBits;
static_assert(kMaxOrdered == std::size_t{1} << kIndexBits);
constexpr int kDigitBits = 8;

/// The code keeps the low 21 bits of a coordinate; tiles 2¹⁸ apart then mix, which only costs time.
std::uint64_t code_of(const Vector3& p_world, const Lattice& lattice) {
  const auto cube = lattice.cube_containing(p_world, 0);
  if (!cube) return 0;
  return morton_code(static_cast<std::uint64_t>(cube->x), static_cast<std::uint64_t>(cube->y),
                     static_cast<std::uint64_t>(cube->z));
}

/// One pass of a radix sort, stable, by the digit at `shift`.
void sort_by_digit(std::span<const std::uint64_t> from, std::span<std::uint64_t> to, int shift) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kDigitBits) - 1;
  std::array<std::uint32_t, kMask + 1> places{};
  for (const std::uint64_t entry : from) ++places[entry >> shift & kMask];
  std::uint32_t sum = 0;
  for (std::uint32_t& place : places) sum += std::exchange(place, sum);
  for (const std::uint64_t entry : from) to[places[entry >> shift & kMask]++] = entry;
}

}  // namespace

std::vector<std::uint32_t> locality_order(std::span<const Vector3> points_world,
                                          const Lattice& lattice) {
  std::vector<std::uint64_t> entries(points_world.size());
  std::uint64_t differing = 0;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    entries[i] = code_of(points_world[i], lattice);
    differing |= entries[i] ^ entries[0];
  }
  // Points of one region share the upper bits of their codes; of more bits than there is room for,
  // the lowest are left out.
  const auto num_bits = static_cast<int>(std::bit_width(differing));
  const int dropped = std::max(0, num_bits - kCodeBits);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    entries[i] = entries[i] >> dropped << kIndexBits | i;
  }
  std::vector<std::uint64_t> sorted(entries.size());
  for (int bit = 0; bit < num_bits - dropped; bit += kDigitBits) {
    sort_by_digit(entries, sorted, kIndexBits + bit);
    entries.swap(sorted);
  }
  std::vector<std::uint32_t> order(entries.size());
  constexpr std::uint64_t kIndexMask = kMaxOrdered - 1;
  std::ranges::transform(entries, order.begin(), [](std::uint64_t entry) {
    return static_cast<std::uint32_t>(entry & kIndexMask);
  });
  return order;
}

}  // namespace gdfmap
