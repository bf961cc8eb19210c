#include "core/lanes.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace gdfmap {
namespace {

/// A float with any bits but those of infinities and NaN.
float any_finite(std::mt19937& generator) {
  for (;;) {
    const auto value = std::bit_cast<float>(static_cast<std::uint32_t>(generator()));
    if (std::isfinite(value)) return value;
  }
}

TEST(FusedMultiplyAdd, RoundsOnceAsTheStandardLibraryDoes) {
  std::mt19937 generator(1);
  for (int i = 0; i < 200000; ++i) {
    const float a = any_finite(generator), b = any_finite(generator);
    // An addend near the product, where a second rounding would show.
    const float c = i % 2 == 0 ? any_finite(generator)
                               : -a * b * std::ldexp(1.0f, static_cast<int>(generator() % 60) - 30);
    if (!std::isfinite(c)) continue;
    const float expected = std::fma(a, b, c);
    ASSERT_EQ(std::bit_cast<std::uint32_t>(fused_multiply_add(a, b, c)),
              std::bit_cast<std::uint32_t>(expected))
        << a << " * " << b << " + " << c;
  }
}

TEST(LanesExp, IsCloseToTheStandardLibrary) {
  using Lanes = PortableLanes<float, 8>;
  for (float x = -86.9f; x < 88.0f; x += 0.0137f) {
    const double expected = std::exp(static_cast<double>(x));
    EXPECT_NEAR(static_cast<double>(exp(Lanes(x)).v[0]), expected, 2e-7 * expected) << x;
  }
  EXPECT_EQ(exp(Lanes(0.0f)).v[0], 1.0f);
  EXPECT_EQ(exp(Lanes(-100.0f)).v[0], 0.0f);
  EXPECT_EQ(exp(Lanes(-std::numeric_limits<float>::infinity())).v[0], 0.0f);
}

}  // namespace
}  // namespace gdfmap
