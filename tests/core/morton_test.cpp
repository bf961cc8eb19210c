#include <gtest/gtest.h>

#include <gdfmap/core/morton.hpp>

namespace gdfmap {
namespace {

TEST(Morton, InterleavesXFirst) {
  EXPECT_EQ(morton_code(1, 0, 0), 1u);
  EXPECT_EQ(morton_code(0, 1, 0), 2u);
  EXPECT_EQ(morton_code(0, 0, 1), 4u);
  EXPECT_EQ(morton_code(0x1fffff, 0x1fffff, 0x1fffff), 0x7fffffffffffffffu);
  EXPECT_EQ(morton_code(0b101, 0b010, 0b001), 0b001'010'101u);
}

TEST(Morton, ComparisonAgreesWithCodes) {
  std::uint64_t state = 1;
  const auto next = [&] {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<std::int64_t>(state >> 33) % 2000;
  };
  for (int i = 0; i < 20000; ++i) {
    const std::int64_t a[3] = {next(), next(), next()};
    const std::int64_t b[3] = {next(), next(), next()};
    const auto code = [](const std::int64_t(&p)[3]) {
      return morton_code(static_cast<std::uint64_t>(p[0]), static_cast<std::uint64_t>(p[1]),
                         static_cast<std::uint64_t>(p[2]));
    };
    EXPECT_EQ(morton_less(a, b), code(a) < code(b));
  }
}

TEST(Morton, NegativeCoordinatesComeFirst) {
  EXPECT_TRUE(morton_less({-1, 0, 0}, {0, 0, 0}));
  EXPECT_FALSE(morton_less({0, 0, 0}, {-1, 0, 0}));
  EXPECT_TRUE(morton_less({-5, 3, 2}, {-4, 3, 2}));
  EXPECT_FALSE(morton_less({7, 7, 7}, {7, 7, 7}));
}

}  // namespace
}  // namespace gdfmap
