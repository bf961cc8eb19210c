#include <algorithm>
#include <array>
#include <utility>

#include <gdfmap/core/morton.hpp>
#include <gdfmap/tiling/block_codec.hpp>

namespace gdfmap {
namespace {

using Codes = std::vector<std::uint64_t>;

constexpr int kCodeBits = 48;
/// From this many codes on, counting short digits is quicker than comparing, and long ones quicker
/// than short ones.
constexpr std::size_t kMinShortDigits = 128;
constexpr std::size_t kMinLongDigits = 8192;

TileOffset from_code(std::uint64_t code) {
  return {static_cast<std::uint16_t>(gather_bits(code)),
          static_cast<std::uint16_t>(gather_bits(code >> 1)),
          static_cast<std::uint16_t>(gather_bits(code >> 2))};
}

/// Radix sort by digits of kBits, least significant first.
template <int kBits>
class RadixSorter {
 public:
  static void sort(Codes& codes) {
    auto counts = count_digits(codes);
    Codes sorted(codes.size());
    for (int place = 0; place < kNumDigits; ++place) {
      Histogram& histogram = counts[static_cast<std::size_t>(place)];
      if (histogram[digit(codes.front(), place)] == codes.size()) continue;  // the same in all
      scatter(codes, sorted, place, histogram);
      codes.swap(sorted);
    }
  }

 private:
  static constexpr int kNumDigits = kCodeBits / kBits;
  static constexpr std::size_t kNumBuckets = std::size_t{1} << kBits;
  using Histogram = std::array<std::uint32_t, kNumBuckets>;

  static std::size_t digit(std::uint64_t code, int place) {
    return (code >> (place * kBits)) & (kNumBuckets - 1);
  }

  static std::array<Histogram, kNumDigits> count_digits(const Codes& codes) {
    std::array<Histogram, kNumDigits> counts{};
    for (const std::uint64_t code : codes) {
      for (int place = 0; place < kNumDigits; ++place) {
        ++counts[static_cast<std::size_t>(place)][digit(code, place)];
      }
    }
    return counts;
  }

  static void scatter(const Codes& from, Codes& to, int place, Histogram& counts) {
    std::uint32_t start = 0;
    for (std::uint32_t& count : counts) start += std::exchange(count, start);
    for (const std::uint64_t code : from) to[counts[digit(code, place)]++] = code;
  }
};

void sort_codes(Codes& codes) {
  if (codes.size() < kMinShortDigits) {
    std::sort(codes.begin(), codes.end());
  } else if (codes.size() < kMinLongDigits) {
    RadixSorter<8>::sort(codes);
  } else {
    RadixSorter<12>::sort(codes);
  }
}

}  // namespace

void sort_unique(std::vector<TileOffset>& points) {
  Codes codes(points.size());
  std::transform(points.begin(), points.end(), codes.begin(),
                 [](const TileOffset& p) { return morton_code(p.x, p.y, p.z); });
  sort_codes(codes);
  codes.erase(std::unique(codes.begin(), codes.end()), codes.end());
  points.resize(codes.size());
  std::transform(codes.begin(), codes.end(), points.begin(), from_code);
}

}  // namespace gdfmap
