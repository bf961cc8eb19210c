#include <cmath>

#include "model_files.hpp"

namespace gdfmap {
namespace {

using Gdf1Writer = ModelTest;
using CsvWriter = ModelTest;

std::string from_hex(const std::string& hex) {
  std::string bytes, digits;
  for (const char c : hex) {
    if (c == ' ') continue;
    digits += c;
    if (digits.size() < 2) continue;
    bytes += static_cast<char>(std::stoi(digits, nullptr, 16));
    digits.clear();
  }
  return bytes;
}

TEST_F(Gdf1Writer, WritesTheBytesOfTheFormat) {
  write_model(path("m.bin"), {make_cube(2, -3, 0, {kFirst, kSecond})});
  const std::string header =
      from_hex(
          "47444631 01000000 01000000"     // GDF1, version, one cube
          "cdcc4c3c 0000803d"              // average MAE 0.0125, standard deviation 0.0625
          "00000040 000040c0 00000000"     // bounds min 2, -3, 0
          "00004040 000000c0 0000803f"     // bounds max 3, -2, 1
          "0000803f 00000000 0000803e") +  // cube size 1, empty search margin 0, margin 0.25
      std::string(64, '\0');
  const std::string cube = from_hex(
      "00000040 000040c0 00000000"    // origin
      "cdcc4c3c 0000803d 02000000");  // MAE, standard deviation, two Gaussians
  const std::string first = from_hex(
      "00000000 00001040 000020c0 0000403f"  // id 0, mean 2.25, -2.5, 0.75
      "0000003f 0000203f 0000403f 0000c03f");
  const std::string second = from_hex(
      "01000000 0000f03f 0000f0bf 00000000"  // id 1, mean 1.875, -1.875, 0
      "0000803f 0000a03f 0000c03e 000020c0");
  ASSERT_EQ(header.size(), 120u);
  ASSERT_EQ(cube.size(), 24u);
  ASSERT_EQ(first.size(), 32u);
  EXPECT_EQ(read_text(path("m.bin")), header + cube + first + second);
}

TEST_F(Gdf1Writer, WritesAModelWithoutCubes) {
  write_model(path("m.bin"), {});
  const Model model = read_model(path("m.bin"));
  EXPECT_TRUE(model.cubes.empty());
  EXPECT_EQ(read_text(path("m.bin")).size(), 120u);
}

TEST_F(CsvWriter, WritesShortestNumbersUnderTheAncestorsColumns) {
  write_model(path("m.csv"), {make_cube(2, -3, 0, {kFirst, {0.1f, 0, 0, 1e-7f, 1, 1, 0.3f}})});
  EXPECT_EQ(read_text(path("m.csv")),
            "CubeX,CubeY,CubeZ,MAE,StdDev,G_ID,MeanX,MeanY,MeanZ,SigmaX,SigmaY,SigmaZ,Weight\n"
            "2,-3,0,0.0125,0.0625,0,2.25,-2.5,0.75,0.5,0.625,0.75,1.5\n"
            "2,-3,0,0.0125,0.0625,1,2.1,-3,0,1e-07,1,1,0.3\n");
}

TEST_F(Gdf1Writer, LeavesNothingWithoutFinish) {
  {
    const auto writer = create_model(path("m.bin"), 1.0, Vector3::Zero(), {});
    writer->write(make_cube(0, 0, 0, {kFirst}));
  }
  EXPECT_TRUE(std::filesystem::is_empty(directory_));
}

TEST_F(Gdf1Writer, RefusesAHeaderThatSpeaksOfOtherCubes) {
  const std::vector<Gdf1Cube> cubes = {make_cube(0, 0, 0, {kFirst})};
  for (const int defect : {0, 1}) {
    const auto writer = create_model(path("m.bin"), 1.0, Vector3::Zero(), {});
    writer->write(cubes.front());
    Gdf1Header header = header_of(cubes, 1.0);
    if (defect == 0) header.num_cubes = 2;
    if (defect == 1) header.cube_size = 2.0;
    EXPECT_EQ(error_of([&] { writer->finish(header); }).code(), ErrorCode::kInternal);
  }
  EXPECT_TRUE(std::filesystem::is_empty(directory_));
}

TEST_F(Gdf1Writer, RefusesCubesThatReadersWouldDrop) {
  const auto writer = create_model(path("m.bin"), 1.0, Vector3::Zero(), {});
  EXPECT_EQ(error_of([&] { writer->write(make_cube(0, 0, 0, {})); }).code(), ErrorCode::kInternal);
  Gdf1Cube coarse = make_cube(0, 0, 0, {kFirst});
  coarse.key.level = 1;
  EXPECT_EQ(error_of([&] { writer->write(coarse); }).code(), ErrorCode::kInternal);
}

TEST_F(Gdf1Writer, NamesTheExtensionsItKnows) {
  const Error error =
      error_of([&] { (void)create_model(path("m.txt"), 1.0, Vector3::Zero(), {}); });
  EXPECT_EQ(error.code(), ErrorCode::kUsage);
  EXPECT_TRUE(contains(error.what(), "m.txt")) << error.what();
  EXPECT_TRUE(contains(error.what(), ".bin (GDF1) or .csv")) << error.what();
  EXPECT_EQ(model_format("A.BIN"), ModelFormat::kGdf1);
  EXPECT_EQ(model_format("a.b/c.Csv"), ModelFormat::kCsv);
}

TEST_F(Gdf1Writer, FailsWithThePathWhereItCannotWrite) {
  const auto missing = directory_ / "none" / "m.bin";
  const Error error = error_of([&] { (void)create_model(missing, 1.0, Vector3::Zero(), {}); });
  EXPECT_EQ(error.code(), ErrorCode::kIo);
  EXPECT_TRUE(contains(error.what(), missing.string())) << error.what();
}

TEST_F(Gdf1Writer, RefusesSizesAndShiftsThatCannotBeWritten) {
  for (const double size : {0.0, -1.0, std::nan("")}) {
    EXPECT_EQ(
        error_of([&] { (void)create_model(path("m.bin"), size, Vector3::Zero(), {}); }).code(),
        ErrorCode::kUsage);
  }
  const Vector3 between(0.5, 0.0, 0.0);
  EXPECT_EQ(error_of([&] { (void)create_model(path("m.bin"), 1.0, between, {}); }).code(),
            ErrorCode::kUsage);
}

/// How the ancestor's evaluator and G-EDF-Loc recover the index of a cube from its origin.
void expect_consumers_recover(const std::string& bytes, const std::vector<std::int64_t>& keys,
                              std::int64_t shift_cubes) {
  const auto size = static_cast<double>(value_at<float>(bytes, 44));
  constexpr std::size_t kStride = 24 + 32;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const auto expected = static_cast<int>(keys[i] - shift_cubes);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto origin = static_cast<double>(value_at<float>(bytes, 120 + i * kStride + 4 * axis));
      EXPECT_EQ(static_cast<int>(std::floor(origin / size)), expected) << "origin " << origin;
      EXPECT_EQ(static_cast<int>(std::floor((origin + 0.01 * size) / size)), expected)
          << "origin " << origin;
    }
  }
}

std::vector<std::int64_t> keys_within(double bound, double size) {
  const auto limit = static_cast<std::int64_t>(bound / size) - 1;
  std::vector<std::int64_t> keys;
  for (std::int64_t k = -300; k <= 300; ++k) keys.push_back(k);
  for (std::int64_t i = 0; i <= 1000; ++i) keys.push_back(-limit + 2 * limit * i / 1000);
  return keys;
}

std::vector<Gdf1Cube> diagonal_cubes(const std::vector<std::int64_t>& keys) {
  std::vector<Gdf1Cube> cubes;
  for (const std::int64_t k : keys) cubes.push_back(make_cube(k, k, k, {kFirst}));
  return cubes;
}

TEST_F(Gdf1Writer, WritesOriginsThatConsumersFindTheCubeBy) {
  for (const double size : {0.1, 0.3, 0.7, 1.0 / 3.0, 1.0, 2.5, 0.05}) {
    const auto keys = keys_within(kMaxUnshiftedBound, size);
    write_model(path("m.bin"), diagonal_cubes(keys), size);
    SCOPED_TRACE(size);
    expect_consumers_recover(read_text(path("m.bin")), keys, 0);
  }
}

TEST_F(Gdf1Writer, WritesShiftedOriginsThatConsumersFindTheCubeBy) {
  for (const double size : {0.1, 0.3, 1.0}) {
    const auto first = static_cast<std::int64_t>(5e6 / size);
    std::vector<std::int64_t> keys;
    for (std::int64_t i = 0; i < 2000; ++i) {
      keys.push_back(first + i * static_cast<std::int64_t>(30.0 / size));
    }
    const auto cubes = diagonal_cubes(keys);
    const Vector3 shift = export_shift(header_of(cubes, size).bounds, size);
    write_model(path("m.bin"), cubes, size, shift);
    SCOPED_TRACE(size);
    expect_consumers_recover(read_text(path("m.bin")), keys, std::llround(shift.x() / size));
    const Model model = read_model(path("m.bin"));
    ASSERT_EQ(model.cubes.size(), cubes.size());
    for (std::size_t i = 0; i < cubes.size(); ++i) EXPECT_EQ(model.cubes[i].key, cubes[i].key);
  }
}

/// Cubes of 1 mm: floats are 0.49 mm apart at 8 km and 1.95 mm at 33 km.
TEST_F(Gdf1Writer, RefusesOriginsThatFloat32CannotTellApart) {
  const auto write_three = [&](std::int64_t first) {
    const auto writer = create_model(path("m.bin"), 0.001, Vector3::Zero(), {});
    for (std::int64_t k = first; k < first + 3; ++k) writer->write(make_cube(k, 0, 0, {kFirst}));
  };
  EXPECT_NO_THROW(write_three(8'000'001));
  const Error error = error_of([&] { write_three(33'000'001); });
  EXPECT_EQ(error.code(), ErrorCode::kUsage);
  EXPECT_TRUE(contains(error.what(), "--region")) << error.what();
}

}  // namespace
}  // namespace gdfmap
