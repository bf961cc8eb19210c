#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/store/surroundings.hpp>

namespace gdfmap {
namespace {

constexpr TileKey kTile{1, 10, -20, 30};

std::vector<SurroundingTile> some_tiles() {
  return {{{1, 9, -21, 31}, {1, 2}}, {{1, 10, -20, 29}, {0, 1}}, {{1, 10, -20, 30}, {3, 0}}};
}

ErrorCode code_of_decoding(const Bytes& bytes) {
  try {
    static_cast<void>(decode_surroundings(kTile, bytes));
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::kInternal;
}

TEST(Surroundings, ReadBackAsWritten) {
  EXPECT_EQ(decode_surroundings(kTile, encode_surroundings(kTile, some_tiles())), some_tiles());
  EXPECT_TRUE(decode_surroundings(kTile, {}).empty());
}

TEST(Surroundings, AreWrittenAsSpecified) {
  const std::vector<SurroundingTile> tiles = {{{1, 9, -20, 32}, {0x0102, 0x0304}}};
  Bytes expected(19);
  expected[0] = std::byte{0xff};
  expected[2] = std::byte{2};
  expected[3] = std::byte{0x02};
  expected[4] = std::byte{0x01};
  expected[11] = std::byte{0x04};
  expected[12] = std::byte{0x03};
  EXPECT_EQ(encode_surroundings(kTile, tiles), expected);
  EXPECT_EQ(surroundings_digest(kTile, tiles), hash128(expected));
}

TEST(Surroundings, OutOfOrderTooFarOrWithoutPointsAreNotWritten) {
  std::vector<SurroundingTile> tiles = some_tiles();
  std::swap(tiles[0], tiles[1]);
  EXPECT_THROW(encode_surroundings(kTile, tiles), Error);
  tiles = {{{1, 10 + 128, -20, 30}, {1, 1}}};
  EXPECT_THROW(encode_surroundings(kTile, tiles), Error);
  tiles = {{kTile, {}}};
  EXPECT_THROW(encode_surroundings(kTile, tiles), Error);
}

TEST(Surroundings, BytesThatCannotHaveBeenWrittenAreCorrupt) {
  const Bytes bytes = encode_surroundings(kTile, some_tiles());
  EXPECT_EQ(code_of_decoding({bytes.begin(), bytes.end() - 1}), ErrorCode::kCorrupt);
  Bytes twice = bytes;
  twice.insert(twice.end(), bytes.end() - 19, bytes.end());
  EXPECT_EQ(code_of_decoding(twice), ErrorCode::kCorrupt);
  EXPECT_EQ(code_of_decoding(Bytes(19)), ErrorCode::kCorrupt) << "no points";
}

}  // namespace
}  // namespace gdfmap
