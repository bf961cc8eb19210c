#include "locality_order.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <utility>

#include <gdfmap/core/morton.hpp>

namespace gdfmap {
namespace {

/// An entry is a code above the index of its point.
constexpr int kIndexBits = 20;
constexpr int kCodeBits = 64 - kIndexBits;
static_assert(kMaxOrdered == std::size_t{1} << kIndexBits);
constexpr int kDigitBits = 8;

/// Where codes count from: a corner of a tile, at or before the first zone along every axis, so
/// that points of a small region have small codes wherever it is.
std::array<std::int64_t, 3> origin_of(std::span<const Vector3> points_world,
                                      const BlendZones& zones) {
  Vector3 low = points_world[0];
  for (const Vector3& p : points_world) low = low.cwiseMin(p);
  auto origin = zones.zone_of(low).value_or(BlendZone()).half_cubes;
  constexpr std::int64_t kHalfCubesPerTileAxis = 2 * kCubesPerTileAxis;
  for (std::int64_t& along : origin) along &= -kHalfCubesPerTileAxis;
  return origin;
}

/// morton_code of coordinates below kTableSize by look-up: the region of most batches has no
/// others.
constexpr std::size_t kTableSize = 1024;
constexpr auto kSpread = [] {
  std::array<std::uint32_t, kTableSize> table{};
  for (std::size_t i = 0; i < kTableSize; ++i) {
    table[i] = static_cast<std::uint32_t>(spread_bits(i));
  }
  return table;
}();

std::uint64_t fast_morton_code(std::uint64_t x, std::uint64_t y, std::uint64_t z) {
  if ((x | y | z) >= kTableSize) return morton_code(x, y, z);
  return kSpread[x] | kSpread[y] << 1 | kSpread[z] << 2;
}

/// Fills in the Morton codes of the points' zones, from the low 21 bits of their coordinates: what
/// lies 2²⁰ cubes apart then mixes, which only costs time. False when equal codes may be different
/// zones.
bool code_zones(std::span<const Vector3> points_world, const BlendZones& zones,
                std::span<std::uint64_t> codes) {
  constexpr int kCodedBits = 21;
  constexpr BlendZone kNowhere;
  const auto origin = origin_of(points_world, zones);
  bool all_are_somewhere = true;
  std::uint64_t used = 0;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const std::optional<BlendZone> zone = zones.zone_of(points_world[i]);
    all_are_somewhere &= zone.has_value();
    const auto& half_cubes = zone ? zone->half_cubes : kNowhere.half_cubes;
    const auto from_origin = [&](std::size_t axis) {
      return static_cast<std::uint64_t>(half_cubes[axis] - origin[axis]);
    };
    const std::uint64_t x = from_origin(0), y = from_origin(1), z = from_origin(2);
    used |= x | y | z;
    codes[i] = fast_morton_code(x, y, z);
  }
  return all_are_somewhere && used >> kCodedBits == 0;
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

std::vector<OrderedPoint> locality_order(std::span<const Vector3> points_world,
                                         const BlendZones& zones) {
  std::vector<std::uint64_t> entries(points_world.size());
  if (entries.empty()) return {};
  const bool are_unique = code_zones(points_world, zones, entries);
  std::uint64_t differing = 0;
  for (const std::uint64_t code : entries) differing |= code ^ entries[0];
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
  const bool tells_zones = are_unique && dropped == 0;
  std::vector<OrderedPoint> order(entries.size());
  std::uint64_t last = ~entries[0];
  for (std::size_t i = 0; i < entries.size(); ++i) {
    constexpr std::uint32_t kIndexMask = kMaxOrdered - 1;
    const bool same_code = (entries[i] ^ last) >> kIndexBits == 0;
    order[i] = {static_cast<std::uint32_t>(entries[i]) & kIndexMask,
                !tells_zones ? ZoneChange::kUnknown
                : same_code  ? ZoneChange::kNone
                             : ZoneChange::kOther};
    last = entries[i];
  }
  return order;
}

}  // namespace gdfmap
