#include <limits>
#include <string>

#include <gtest/gtest.h>

#include <gdfmap/core/hash.hpp>

namespace gdfmap {
namespace {

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

TEST(Hash, IsXxh3WithSeedZero) {
  // Published test values of XXH3 for the empty input.
  EXPECT_EQ(hash64({}), 0x2d06800538d394c2u);
  EXPECT_EQ(hash128({}).hex(), "99aa06d3014798d86001c324468d497f");
}

TEST(Hash, StreamedEqualsWhole) {
  const std::string text(100'000, 'x');
  StreamHasher hasher;
  for (std::size_t i = 0; i < text.size(); i += 777) hasher.update(bytes_of(text.substr(i, 777)));
  EXPECT_EQ(hasher.digest(), hash128(bytes_of(text)));
}

TEST(Digest, SumCarriesAndDoesNotDependOnOrder) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  Digest sum{kMost, 1};
  sum += Digest{1, 0};
  EXPECT_EQ(sum, (Digest{0, 2}));
  Digest twice{kMost, 1};
  twice += twice;
  EXPECT_EQ(twice, (Digest{kMost - 1, 3}));
  Digest ab = hash128(bytes_of("a")), ba = hash128(bytes_of("b"));
  ab += hash128(bytes_of("b"));
  ba += hash128(bytes_of("a"));
  EXPECT_EQ(ab, ba);
}

TEST(Digest, HexReadsBack) {
  const Digest digest = hash128(bytes_of("gdfmap"));
  EXPECT_EQ(Digest::from_hex(digest.hex()), digest);
  EXPECT_FALSE(Digest::from_hex("12"));
  EXPECT_FALSE(Digest::from_hex(std::string(31, '0') + "g"));
}

}  // namespace
}  // namespace gdfmap
