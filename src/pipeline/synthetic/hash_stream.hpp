#pragma once

#include <cstdint>

namespace gdfmap::synthetic {

/// Numbers that look random and depend on nothing but their place in the sequence of a seed: no
/// state is shared, and integer arithmetic makes them the same everywhere (SplitMix64, Steele et
/// al. 2014).
class HashStream {
 public:
  explicit HashStream(std::uint64_t seed) : state_(mix(seed)) {}
  /// The stream of one member (`index`) of a family (`seed`).
  HashStream(std::uint64_t seed, std::uint64_t index) : state_(mix(mix(seed) ^ index)) {}

  std::uint64_t next() { return mix(state_ += 0x9e3779b97f4a7c15u); }
  /// In (0, 1): neither end occurs.
  double uniform() { return (static_cast<double>(next() >> 11) + 0.5) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  bool chance(double probability) { return uniform() < probability; }

  [[nodiscard]] static constexpr std::uint64_t mix(std::uint64_t h) {
    h = (h ^ h >> 30) * 0xbf58476d1ce4e5b9u;
    h = (h ^ h >> 27) * 0x94d049bb133111ebu;
    return h ^ h >> 31;
  }

 private:
  std::uint64_t state_;
};

}  // namespace gdfmap::synthetic
