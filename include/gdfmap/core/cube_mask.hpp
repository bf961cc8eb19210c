#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include <gdfmap/core/lattice.hpp>

namespace gdfmap {

/// Which of a tile's 512 cubes hold at least one point; bit cube_index(x, y, z).
class CubeMask {
 public:
  static constexpr std::size_t kNumWords = kCubesPerTile / 64;

  void set(int index) { words_[word(index)] |= bit(index); }
  [[nodiscard]] bool test(int index) const { return (words_[word(index)] & bit(index)) != 0; }
  [[nodiscard]] int count() const {
    int total = 0;
    for (const std::uint64_t w : words_) total += std::popcount(w);
    return total;
  }
  [[nodiscard]] bool any() const { return count() > 0; }
  CubeMask& operator|=(const CubeMask& other) {
    for (std::size_t i = 0; i < kNumWords; ++i) words_[i] |= other.words_[i];
    return *this;
  }
  bool operator==(const CubeMask&) const = default;

  /// Eight words, cube 0 in the lowest bit of the first: the form in which masks are stored.
  [[nodiscard]] std::array<std::uint64_t, kNumWords>& words() { return words_; }
  [[nodiscard]] const std::array<std::uint64_t, kNumWords>& words() const { return words_; }

 private:
  static std::size_t word(int index) { return static_cast<std::size_t>(index) / 64; }
  static std::uint64_t bit(int index) { return std::uint64_t{1} << (index % 64); }

  std::array<std::uint64_t, kNumWords> words_{};
};

/// A level-0 tile that holds points.
struct OccupiedTile {
  TileKey key;
  CubeMask cubes;
  bool operator==(const OccupiedTile&) const = default;
};

}  // namespace gdfmap
