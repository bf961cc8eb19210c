#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/morton.hpp>
#include <gdfmap/tiling/block_codec.hpp>

namespace gdfmap {
namespace {

using Points = std::vector<TileOffset>;

std::uint64_t code(const TileOffset& p) { return morton_code(p.x, p.y, p.z); }

bool morton_before(const TileOffset& a, const TileOffset& b) { return code(a) < code(b); }

Points random_points(std::size_t count, std::uint32_t seed, std::uint32_t mask = 0xffff) {
  std::mt19937 random(seed);
  const auto coordinate = [&] { return static_cast<std::uint16_t>(random() & mask); };
  Points points(count);
  for (TileOffset& p : points) p = {coordinate(), coordinate(), coordinate()};
  return points;
}

/// A sloping surface.
Points surface_points(std::size_t count, std::uint32_t seed) {
  Points points = random_points(count, seed);
  for (TileOffset& p : points) p.z = static_cast<std::uint16_t>(20'000 + p.x / 8);
  sort_unique(points);
  return points;
}

Bytes bytes_of(std::initializer_list<int> values) {
  Bytes bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

bool is_refused(const Bytes& bytes) {
  try {
    static_cast<void>(decode_block(bytes));
  } catch (const Error& error) {
    return error.code() == ErrorCode::kCorrupt;
  }
  return false;
}

TEST(SortUnique, AgreesWithAComparatorSortAtEverySize) {
  for (const std::size_t count :
       {0u, 1u, 2u, 7u, 127u, 128u, 300u, 8191u, 8192u, 30'000u, 65'536u}) {
    // Narrow coordinates make duplicates, wide ones fill every digit.
    for (const std::uint32_t mask : {0x3u, 0xffu, 0xff00u, 0xffffu}) {
      Points points = random_points(count, static_cast<std::uint32_t>(count) + mask, mask);
      Points expected = points;
      std::sort(expected.begin(), expected.end(), morton_before);
      expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
      sort_unique(points);
      ASSERT_EQ(points, expected) << count << " points, mask " << mask;
    }
  }
}

TEST(SortUnique, KeepsTheExtremes) {
  Points points{{65535, 65535, 65535}, {0, 0, 0}, {65535, 65535, 65535}};
  sort_unique(points);
  EXPECT_EQ(points, (Points{{0, 0, 0}, {65535, 65535, 65535}}));
}

TEST(BlockCodec, WritesTheBytesOfTheSpecification) {
  const Points points{{1, 2, 3}, {0, 2, 260}};
  const Bytes expected = bytes_of({2, 0, 1, 0, 1, 0, 2, 0, 3, 0, 0, 0, 2, 0, 4, 1});
  EXPECT_EQ(encode_block(points), expected);
  EXPECT_EQ(decode_block(expected), points);
}

/// 32 points along x, one step apart: the number 0 once, then the folded difference 2 31 times.
const Points& points_in_a_row() {
  static const Points points = [] {
    Points row;
    for (std::uint16_t x = 0; x < 32; ++x) row.push_back({x, 0, 0});
    return row;
  }();
  return points;
}

Bytes block_of_a_row() {
  return bytes_of({2,    1,    31,   0,                          // header
                   1,    1,    0,    0,    0,    0,    0,    0,  // x: lengths 0 and 2 in one bit
                   0x10, 0,    0,    0,    0,    0,    0,    0,  // y: length 0 alone
                   0,    1,    0,    0,    0,    0,    0,    0,  // z: the same
                   0,    0,                                      //
                   8,    0,    0,    0,    0,    0,    0,    0,  // bytes of x, of y
                   0xaa, 0xaa, 0xaa, 0xaa, 0xaa, 0xaa, 0xaa, 0x2a});  // 0, then 31 times 1, 0
}

TEST(BlockCodec, WritesACodedBlockOfTheSpecification) {
  EXPECT_EQ(encode_block(points_in_a_row()), block_of_a_row());
  EXPECT_EQ(decode_block(block_of_a_row()), points_in_a_row());
}

TEST(BlockCodec, RefusesWhatIsNoPrefixCode) {
  const auto changed = [](std::size_t at, int value) {
    Bytes bytes = block_of_a_row();
    bytes[at] = static_cast<std::byte>(value);
    return bytes;
  };
  EXPECT_TRUE(is_refused(changed(4, 0x11)));   // three words of one bit
  EXPECT_TRUE(is_refused(changed(4, 0x02)));   // words that leave a gap
  EXPECT_TRUE(is_refused(changed(12, 0x00)));  // none
  EXPECT_TRUE(is_refused(changed(12, 0x20)));  // one, of two bits
  EXPECT_TRUE(is_refused(changed(21, 0x09)));  // a word that is too long
  EXPECT_TRUE(is_refused(changed(29, 0x10)));  // the half byte behind the last code
}

TEST(BlockCodec, RefusesStreamsThatDoNotHoldTheirNumbers) {
  const auto changed = [](std::size_t at, int value) {
    Bytes bytes = block_of_a_row();
    bytes[at] = static_cast<std::byte>(value);
    return bytes;
  };
  EXPECT_TRUE(is_refused(changed(30, 7)));     // the last byte would be z's
  EXPECT_TRUE(is_refused(changed(30, 9)));     // longer than what is there
  EXPECT_TRUE(is_refused(changed(33, 0xff)));  // far longer
  EXPECT_TRUE(is_refused(changed(34, 1)));     // y takes no room
  EXPECT_TRUE(is_refused(changed(45, 0xaa)));  // bits behind the last number
  EXPECT_TRUE(is_refused(changed(2, 30)));     // a point less
  EXPECT_TRUE(is_refused(changed(2, 32)));     // a point more
}

TEST(BlockCodec, RoundTripsDifferencesOfEveryLengthWithAndWithoutRareOnes) {
  // Numbers of points that halve with the length ask for code words longer than there are.
  Points points;
  std::uint32_t z = 0;
  for (int length = 0; length <= 14; ++length) {
    for (int i = 0; i < 1 << (14 - length); ++i) {
      z += 1u << length >> 1;
      points.push_back(
          {static_cast<std::uint16_t>(points.size() % 2), 0, static_cast<std::uint16_t>(z)});
    }
  }
  sort_unique(points);
  EXPECT_EQ(decode_block(encode_block(points)), points);
  const Points far_apart{{0, 0, 0}, {65535, 0, 0}, {0, 65535, 0}, {65535, 65535, 65535}};
  EXPECT_EQ(decode_block(encode_block(far_apart)), far_apart);
}

TEST(BlockCodec, RoundTripsEverySize) {
  for (const std::size_t count : {1u, 2u, 3u, 100u, 4096u, 65'535u, 65'536u}) {
    Points points = random_points(count, 5);
    sort_unique(points);
    EXPECT_EQ(decode_block(encode_block(points)), points) << count;
    const Points surface = surface_points(count, 6);
    EXPECT_EQ(decode_block(encode_block(surface)), surface) << count;
  }
}

TEST(BlockCodec, PacksASurfaceAndNeverGrowsNoise) {
  const Points surface = surface_points(kMaxBlockPoints, 1);
  EXPECT_LT(encode_block(surface).size(), surface.size() * 6 * 5 / 8);
  for (const std::size_t count : {1u, 10u, 1000u}) {
    Points noise = random_points(count, 2);
    sort_unique(noise);
    EXPECT_LE(encode_block(noise).size(), noise.size() * 6 + 4);
  }
}

TEST(BlockCodec, RefusesToEncodeWhatNoBlockCanHold) {
  EXPECT_THROW(static_cast<void>(encode_block({})), Error);
  EXPECT_THROW(static_cast<void>(encode_block(Points(kMaxBlockPoints + 1))), Error);
}

TEST(BlockCodec, RefusesEveryPrefix) {
  for (const Points& points : {surface_points(3000, 3), Points{{1, 2, 3}, {0, 2, 260}}}) {
    const Bytes whole = encode_block(points);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      ASSERT_TRUE(is_refused(Bytes(whole.begin(), whole.begin() + static_cast<long>(size))))
          << size;
    }
  }
}

TEST(BlockCodec, RefusesTrailingBytes) {
  Bytes bytes = encode_block(surface_points(3000, 3));
  bytes.push_back(std::byte{0});
  EXPECT_TRUE(is_refused(bytes));
  EXPECT_TRUE(is_refused(bytes_of({2, 0, 0, 0, 1, 0, 2, 0, 3, 0, 9})));
}

TEST(BlockCodec, RefusesUnknownFormatsAndPackings) {
  EXPECT_TRUE(is_refused(bytes_of({1, 0, 0, 0, 2, 0, 4, 0, 6, 0})));
  EXPECT_TRUE(is_refused(bytes_of({2, 2, 0, 0, 2, 0, 4, 0, 6, 0})));
  EXPECT_FALSE(is_refused(bytes_of({2, 0, 0, 0, 2, 0, 4, 0, 6, 0})));
}

TEST(BlockCodec, RefusesPointsOutOfOrderOrTwice) {
  EXPECT_TRUE(is_refused(encode_block(Points{{2, 0, 0}, {1, 0, 0}})));
  EXPECT_TRUE(is_refused(encode_block(Points{{1, 0, 0}, {1, 0, 0}})));
}

TEST(BlockCodec, SurvivesDamageWithAnErrorOrWithValidPoints) {
  std::mt19937 random(11);
  for (const std::size_t count : {1u, 40u, 2000u}) {
    const Bytes whole = encode_block(surface_points(count, 4));
    int num_refused = 0;
    constexpr int kTrials = 5000;
    for (int trial = 0; trial < kTrials; ++trial) {
      Bytes bytes = whole;
      for (std::uint32_t flips = 1 + random() % 4; flips > 0; --flips) {
        bytes[random() % bytes.size()] ^= static_cast<std::byte>(1 + random() % 255);
      }
      if (is_refused(bytes)) {
        ++num_refused;
        continue;
      }
      const Points points = decode_block(bytes);
      ASSERT_LE(points.size(), kMaxBlockPoints);
      ASSERT_EQ(std::adjacent_find(points.begin(), points.end(),
                                   [](const auto& a, const auto& b) { return code(a) >= code(b); }),
                points.end());
    }
    EXPECT_GT(num_refused, kTrials / 5) << count;
  }
}

TEST(BlockCodec, SurvivesNoise) {
  std::mt19937 random(12);
  for (int trial = 0; trial < 5000; ++trial) {
    Bytes bytes(random() % 200);
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
    if (bytes.size() > 1) {
      bytes[0] = std::byte{2};
      bytes[1] = static_cast<std::byte>(random() % 2);
    }
    if (is_refused(bytes)) continue;
    EXPECT_LE(decode_block(bytes).size(), kMaxBlockPoints);
  }
}

TEST(TileOffset, KnowsItsCube) {
  EXPECT_EQ((TileOffset{0, 0, 0}.cube()), 0);
  EXPECT_EQ((TileOffset{8191, 8192, 65535}.cube()), cube_index(0, 1, 7));
}

}  // namespace
}  // namespace gdfmap
