#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include <gdfmap/store/tile_codec.hpp>

#include "sample_tiles.hpp"

namespace gdfmap {
namespace {

using test::failed_cube;
using test::quantized_tile;
using test::sample_cube;
using test::sample_tile;

std::string hex(std::span<const std::byte> bytes) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::byte b : bytes) {
    const auto value = std::to_integer<unsigned>(b);
    text += {kDigits[value >> 4], kDigits[value & 15]};
  }
  return text;
}

bool same_bits(float a, float b) { return std::memcmp(&a, &b, sizeof(float)) == 0; }

void expect_equal(const CubeRecord& a, const CubeRecord& b) {
  EXPECT_EQ(a.index, b.index);
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.cube_class, b.cube_class);
  EXPECT_EQ(a.failure, b.failure);
  EXPECT_EQ(a.num_iterations, b.num_iterations);
  EXPECT_TRUE(same_bits(a.errors.mae, b.errors.mae));
  EXPECT_TRUE(same_bits(a.errors.rmse, b.errors.rmse));
  EXPECT_TRUE(same_bits(a.errors.p95, b.errors.p95));
  EXPECT_TRUE(same_bits(a.errors.max, b.errors.max));
  EXPECT_TRUE(same_bits(a.reach, b.reach));
  EXPECT_EQ(a.input, b.input);
  EXPECT_EQ(a.gaussians, b.gaussians);
}

/// One fitted cube with one Gaussian and one failed cube, in numbers that can be told apart.
TileRecord golden_tile() {
  TileRecord tile;
  tile.key = {1, -2, 3, -4};
  CubeRecord cube;
  cube.index = 9;
  cube.status = CubeStatus::kPoor;
  cube.cube_class = CubeClass::kPopulated;
  cube.num_iterations = 12;
  cube.errors = {1.0f, 2.0f, 3.0f, 4.0f};
  cube.reach = 5.0f;
  cube.input = 0x010203040506u;
  cube.gaussians = Gaussians(1);
  for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
    cube.gaussians.at(row, 0) = 0.5f * static_cast<float>(row + 1);
  }
  tile.cubes = {cube, failed_cube(300)};
  tile.cubes[1].errors = {};
  return tile;
}

// clang-format off
constexpr char kGoldenHex[] =
    "47445431" "0200" "0000" "0200" "01000000"                // header
    "0900" "01" "01" "00" "0c000000" "01000000"               // cube 9
    "0000803f" "00000040" "00004040" "00008040" "0000a040"    // its errors and reach
    "0605040302010000"                                        // its input digest
    "2c01" "02" "00" "01" "00000000" "00000000"               // cube 300
    "00000000" "00000000" "00000000" "00000000" "00000000"
    "0000000000000000"
    "0000003f" "0000803f" "0000c03f"                          // means
    "00000040" "00002040" "00004040"                          // root sigmas
    "00006040";                                               // weight
// clang-format on

TEST(TileCodec, WritesTheBytesThatTheFormatSpecifies) {
  const Bytes bytes = encode_tile(golden_tile());
  EXPECT_EQ(bytes.size(), 14u + 2 * 41 + 28);
  EXPECT_EQ(hex(bytes), kGoldenHex);
}

Bytes from_hex(const std::string& text) {
  Bytes bytes(text.size() / 2);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::byte>(std::stoi(text.substr(2 * i, 2), nullptr, 16));
  }
  return bytes;
}

// clang-format off
constexpr char kGoldenContentHex[] =
    "01000000" "feffffff" "03000000" "fcffffff"                                   // key
    "0900" "01" "0000803f" "00000040" "00004040" "00008040" "01000000"            // cube 9
    "0000003f" "0000803f" "0000c03f" "00000040" "00002040" "00004040" "00006040"  // its rows
    "2c01" "02" "00000000" "00000000" "00000000" "00000000" "00000000";           // cube 300
// clang-format on

TEST(TileCodec, DigestsTheContentThatTheFormatSpecifies) {
  EXPECT_EQ(content_digest(golden_tile()), hash128(from_hex(kGoldenContentHex)));
}

TEST(TileCodec, ReadsBackWhatItWrote) {
  const TileRecord tile = sample_tile({0, 1, 2, 3}, 5);
  const std::vector<CubeRecord> cubes = decode_tile(encode_tile(tile)).cubes;
  ASSERT_EQ(cubes.size(), tile.cubes.size());
  for (std::size_t i = 0; i < cubes.size(); ++i) expect_equal(cubes[i], tile.cubes[i]);
}

TEST(TileCodec, HoldsATileWithoutCubesAndAFullOne) {
  TileRecord tile;
  EXPECT_TRUE(decode_tile(encode_tile(tile)).cubes.empty());
  for (int i = 0; i < kCubesPerTile; ++i) {
    tile.cubes.push_back(sample_cube(i, 1 + static_cast<std::size_t>(i) % 3, 7));
  }
  EXPECT_EQ(decode_tile(encode_tile(tile)).cubes.size(), static_cast<std::size_t>(kCubesPerTile));
}

/// A change to a valid tile that makes it one that no blob can hold.
void expect_not_encodable(const std::function<void(TileRecord&)>& spoil) {
  TileRecord tile = sample_tile({}, 1);
  spoil(tile);
  try {
    static_cast<void>(encode_tile(tile));
    FAIL() << "encoded";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInternal);
    EXPECT_NE(std::string(error.what()).find("cube "), std::string::npos) << error.what();
  }
}

TEST(TileCodec, RefusesToWriteWhatItCouldNotRead) {
  const auto root_sigma = [](TileRecord& t) -> float& {
    return t.cubes[0].gaussians.at(kRootSigmaX + 1, 2);
  };
  expect_not_encodable([](TileRecord& t) { std::swap(t.cubes[0], t.cubes[1]); });
  expect_not_encodable([](TileRecord& t) { t.cubes[1].index = t.cubes[0].index; });
  expect_not_encodable([](TileRecord& t) { t.cubes[0].index = -1; });
  expect_not_encodable([](TileRecord& t) { t.cubes[3].index = kCubesPerTile; });
  expect_not_encodable([](TileRecord& t) { t.cubes[0].num_iterations = -1; });
  expect_not_encodable([](TileRecord& t) { t.cubes[0].input = kMaxInputDigest + 1; });
  expect_not_encodable([](TileRecord& t) { t.cubes[0].gaussians = Gaussians(); });
  expect_not_encodable([](TileRecord& t) { t.cubes[0].failure = FailureReason::kNotFinite; });
  expect_not_encodable([](TileRecord& t) { t.cubes[2].failure = FailureReason::kNone; });
  expect_not_encodable([](TileRecord& t) { t.cubes[2].status = CubeStatus::kPoor; });
  expect_not_encodable([](TileRecord& t) { t.cubes[0].gaussians.at(kWeight, 0) = HUGE_VALF; });
  expect_not_encodable([](TileRecord& t) { t.cubes[0].gaussians.at(kMeanX, 0) = NAN; });
  expect_not_encodable([&](TileRecord& t) { root_sigma(t) = 0.0f; });
  expect_not_encodable([&](TileRecord& t) { root_sigma(t) = kMinRootSigma / 2; });
}

TEST(TileCodec, SmallestRootSigmaHasAFiniteInverseFourthPower) {
  CubeRecord cube = sample_cube(0, 1, 1);
  cube.gaussians.at(kRootSigmaX, 0) = -kMinRootSigma;
  TileRecord tile;
  tile.cubes = {cube};
  EXPECT_EQ(decode_tile(encode_tile(tile)).cubes[0].gaussians, cube.gaussians);
  EXPECT_TRUE(std::isfinite(Kernel(cube.gaussians).view().row(kRootSigmaX)[0]));
}

void expect_corrupt(std::span<const std::byte> bytes, const char* message) {
  try {
    static_cast<void>(decode_tile(bytes));
    FAIL() << "decoded; expected: " << message;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
  }
}

TEST(TileCodec, NamesWhatIsWrongWithDamagedBytes) {
  const Bytes good = encode_tile(golden_tile());
  const auto damaged = [&](std::size_t offset, int value) {
    Bytes bytes = good;
    bytes[offset] = static_cast<std::byte>(value);
    return bytes;
  };
  expect_corrupt(damaged(0, 'X'), "not a tile");
  expect_corrupt(damaged(4, 1), "tile format version 1");
  expect_corrupt(damaged(6, 2), "codec 2");
  expect_corrupt(damaged(6, 1), "edge");
  expect_corrupt(damaged(8, 3), "size does not match");
  expect_corrupt(damaged(9, 3), "cubes in a tile");
  expect_corrupt(damaged(12, 1), "size does not match");
  expect_corrupt(damaged(16, 3), "status 3");
  expect_corrupt(damaged(17, 3), "class 3");
  expect_corrupt(damaged(18, 2), "failure 2");
  expect_corrupt(damaged(22, 0x80), "iterations");
  expect_corrupt(damaged(23, 2), "do not add up");
  expect_corrupt(damaged(14 + 40, 1), "cube 9: input digest has more than 48 bits");
  expect_corrupt(damaged(14 + 41 + 1, 2), "cube 556: index is out of range");
  Bytes twice = damaged(14 + 41, 9);
  twice[14 + 41 + 1] = std::byte{0};
  expect_corrupt(twice, "cube 9: index is not above");
  Bytes infinite = damaged(good.size() - 1, 0x7f);
  infinite[good.size() - 2] = std::byte{0x80};
  expect_corrupt(infinite, "cube 9: a parameter");
}

TEST(TileCodec, RefusesEveryTruncationAndEveryTrailingByte) {
  Bytes bytes = encode_tile(golden_tile());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_THROW(static_cast<void>(decode_tile(std::span(bytes).first(size))), Error) << size;
  }
  bytes.push_back(std::byte{0});
  expect_corrupt(bytes, "size does not match");
}

TEST(TileCodec, QuantizedTilesReadBackWhatWasWritten) {
  for (const double edge : {1.0, 0.37, 4.0, 16.0}) {
    const TileRecord tile = quantized_tile(edge);
    const Bytes bytes = encode_tile(tile);
    std::size_t num_empty = 0;  // Gaussians of cubes without points
    for (const CubeRecord& cube : tile.cubes) {
      if (cube.cube_class == CubeClass::kEmpty) num_empty += cube.gaussians.size();
    }
    ASSERT_GT(num_empty, 0u);
    ASSERT_LT(num_empty, 27u);
    EXPECT_EQ(bytes.size(), 14 + 8 + 64 + 4 * 16 + 27 * 8 - num_empty);
    const TileRecord read = decode_tile(bytes);
    EXPECT_EQ(read.codec, CubeCodec::kQuantized);
    EXPECT_EQ(read.cube_edge, edge);
    ASSERT_EQ(read.cubes.size(), tile.cubes.size());
    for (std::size_t i = 0; i < read.cubes.size(); ++i) expect_equal(read.cubes[i], tile.cubes[i]);
  }
}

// clang-format off
constexpr char kGoldenQuantizedHex[] =
    "47445431" "0200" "0100" "0300" "03000000" "000000000000f03f"  // header, edge 1 m
    "0002000000000000" "0000000000000000" "0000000000000000" "0001000000000000"  // mask: 9, 200
    "0000000000100000" "0000000000000000" "0000000000000000" "0000000000000000"  // and 300
    "05" "0c" "02" "c1" "d1" "e1" "f1" "b1" "060504030201" "007e"  // cube 9: poor, populated
    "00" "00" "01" "00" "00" "00" "00" "00" "000000000000" "007d"  // cube 200: fitted, empty
    "12" "00" "00" "00" "00" "00" "00" "00" "000000000000" "0000"  // cube 300: failed, not finite
    "00fc030800f8f7ff"                                           // codes 0 510 0, 1 0 255, 4095
    "fe018000f8ffff3f"                                           // codes 510 0 32, 0 255 255, −2048
    "00fc017f400000";                                            // codes 0 252 1, 127 0 1, −1023
// clang-format on

TileRecord golden_quantized_tile() {
  TileRecord tile = golden_tile();
  tile.codec = CubeCodec::kQuantized;
  tile.cube_edge = 1.0;
  const auto put = [](Gaussians& g, std::size_t k, const GaussianGrid& grid,
                      const std::array<int, 3>& means, const std::array<int, 3>& sigmas,
                      float weight) {
    for (std::size_t a = 0; a < 3; ++a) {
      g.at(kMeanX + a, k) = stored_mean(grid.mean_of_code(means[a]), 1.0);
      g.at(kRootSigmaX + a, k) = stored_root_sigma(grid.sigma_of_code(sigmas[a]), 1.0);
    }
    g.at(kWeight, k) = weight;
  };
  const GaussianGrid& fine = GaussianGrid::fine();
  CubeRecord& populated = tile.cubes[0];
  populated.errors = {1.0f, 2.0f, 4.0f, 8.0f};
  populated.reach = 0.5f;
  populated.gaussians = Gaussians(2);
  put(populated.gaussians, 0, fine, {0, 510, 0}, {1, 0, 255}, 0.5f);
  put(populated.gaussians, 1, fine, {510, 0, 32}, {0, 255, 255}, fine.weight_of_code(-2048, 0.5f));
  CubeRecord empty;
  empty.index = 200;
  empty.gaussians = Gaussians(1);
  put(empty.gaussians, 0, GaussianGrid::coarse(), {0, 252, 1}, {127, 0, 1}, -0.25f);
  tile.cubes.insert(tile.cubes.begin() + 1, empty);
  return tile;
}

TEST(TileCodec, WritesTheQuantizedBytesThatTheFormatSpecifies) {
  EXPECT_EQ(hex(encode_tile(golden_quantized_tile())), kGoldenQuantizedHex);
}

TEST(TileCodec, RefusesToQuantizeWhatIsNotOnTheGrid) {
  const auto expect_refused = [](const std::function<void(TileRecord&)>& spoil) {
    TileRecord tile = quantized_tile(1.0);
    spoil(tile);
    EXPECT_THROW(static_cast<void>(encode_tile(tile)), Error);
  };
  expect_refused([](TileRecord& t) { t.cubes[0].gaussians.at(kMeanX, 0) += 1e-5f; });
  expect_refused([](TileRecord& t) { t.cubes[0].gaussians.at(kRootSigmaX, 0) += 1e-5f; });
  expect_refused([](TileRecord& t) { t.cubes[1].gaussians.at(kWeight, 3) += 1e-5f; });
  expect_refused([](TileRecord& t) { t.cubes[0].errors.mae = 0.1f; });
  expect_refused([](TileRecord& t) { t.cubes[0].num_iterations = 256; });
  expect_refused([](TileRecord& t) { t.cubes[0].gaussians = Gaussians(300); });
  expect_refused([](TileRecord& t) { t.cube_edge = 2.0; });
}

TEST(TileCodec, NamesWhatIsWrongWithDamagedQuantizedBytes) {
  const Bytes good = encode_tile(golden_quantized_tile());
  const auto damaged = [&](std::size_t offset, int value) {
    Bytes bytes = good;
    bytes[offset] = static_cast<std::byte>(value);
    return bytes;
  };
  constexpr std::size_t kMask = 14 + 8, kRecord = kMask + 64, kGaussian = kRecord + 3 * 16;
  expect_corrupt(damaged(kMask, 1), "the mask does not hold 3 cubes");
  expect_corrupt(damaged(kRecord, 3), "cube 9: kind 3");
  expect_corrupt(damaged(kRecord + 2, 7), "do not add up");
  expect_corrupt(damaged(kRecord, 1), "size does not match");  // an empty cube's are shorter
  expect_corrupt(damaged(kGaussian + 16 + 6, 0x40), "cube 200: the scale of its weights");
  Bytes heavy = damaged(kGaussian + 7, 0xff);
  heavy[kGaussian + 6] = std::byte{0xff};
  Bytes beyond = damaged(kGaussian, 0xff);  // a mean of 511
  beyond[kGaussian + 1] |= std::byte{1};
  expect_corrupt(beyond, "cube 9: a mean or a weight is out of range");
  expect_corrupt(heavy, "cube 9: a mean or a weight is out of range");
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_THROW(static_cast<void>(decode_tile(std::span(good).first(size))), Error) << size;
  }
}

void expect_to_survive(const Bytes& good) {
  std::mt19937 random(11);
  int num_refused = 0;
  for (int round = 0; round < 20000; ++round) {
    Bytes bytes = good;
    const auto flips = 1 + random() % 4;
    for (std::uint32_t i = 0; i < flips; ++i) {
      // Mostly in the header and the records, where a wrong number does harm.
      const std::size_t range = random() % 2 == 0 ? 14 + 8 + 64 + 4 * 16 : bytes.size();
      bytes[random() % range] = static_cast<std::byte>(random());
    }
    if (random() % 4 == 0) bytes.resize(random() % (bytes.size() + 1));
    try {
      EXPECT_EQ(encode_tile(decode_tile(bytes)), bytes);  // whatever is accepted is a tile
    } catch (const Error& error) {
      ASSERT_EQ(error.code(), ErrorCode::kCorrupt) << error.what();
      ++num_refused;
    }
  }
  EXPECT_GT(num_refused, 5000);
}

TEST(TileCodec, SurvivesAnyBytes) {
  expect_to_survive(encode_tile(sample_tile({0, 1, 2, 3}, 5)));
  expect_to_survive(encode_tile(quantized_tile(1.0)));
}

TEST(TileCodec, ContentDigestSpeaksOfTheFieldAlone) {
  const TileRecord tile = sample_tile({0, 1, 2, 3}, 5);
  const auto digest_after = [&](const std::function<void(TileRecord&)>& change) {
    TileRecord changed = tile;
    change(changed);
    return content_digest(changed);
  };
  const Digest digest = content_digest(tile);
  EXPECT_EQ(digest, digest_after([](TileRecord& t) {
              t.surroundings = {};
              t.configuration = {};
              t.cubes[0].cube_class = CubeClass::kUnknown;
              t.cubes[0].num_iterations += 1;
              t.cubes[0].reach += 1.0f;
              t.cubes[0].input ^= 1;
              t.cubes[2].failure = FailureReason::kNone;
            }));
  const std::function<void(TileRecord&)> changes[] = {
      [](TileRecord& t) { t.key.level = 1; },
      [](TileRecord& t) { t.key.z = -3; },
      [](TileRecord& t) { t.cubes[0].index = 1; },
      [](TileRecord& t) { t.cubes[0].status = CubeStatus::kPoor; },
      [](TileRecord& t) { t.cubes[0].errors.p95 += 1e-3f; },
      [](TileRecord& t) { t.cubes[2].errors.max = -t.cubes[2].errors.max; },  // a NaN's sign
      [](TileRecord& t) { t.cubes.erase(t.cubes.begin() + 2); },              // the failed one
      [](TileRecord& t) { t.cubes[3].gaussians.at(kWeight, 2) += 1e-3f; },
  };
  for (const auto& change : changes) EXPECT_NE(digest, digest_after(change));
}

}  // namespace
}  // namespace gdfmap
