#include <cmath>
#include <limits>
#include <random>

#include "model_files.hpp"

namespace gdfmap {
namespace {

using ModelReader = ModelTest;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Where things stand in a file of one-Gaussian cubes.
constexpr std::size_t kCubeStride = 24 + 32;
constexpr std::size_t kOrigin = 120;
constexpr std::size_t kGaussian = kOrigin + 24;
constexpr std::size_t kMean = kGaussian + 4;
constexpr std::size_t kRootSigma = kMean + 12;
constexpr std::size_t kWeightOffset = kRootSigma + 12;

std::vector<Gdf1Cube> random_cubes(double cube_size, std::uint32_t seed) {
  std::mt19937 engine(seed);
  const auto uniform = [&](double low, double high) {
    return static_cast<float>(low + (high - low) * static_cast<double>(engine()) / 4294967296.0);
  };
  std::vector<Gdf1Cube> cubes;
  for (std::int64_t i = 0; i < 200; ++i) {
    std::vector<Parameters> list(1 + engine() % 4);
    for (Parameters& g : list) {
      for (std::size_t a = 0; a < 3; ++a) {
        g[a] = uniform(-cube_size, 2.0 * cube_size);
        g[3 + a] = uniform(0.05, 1.5);
      }
      g[6] = uniform(-3.0, 3.0);
    }
    const auto coordinate = [&] { return static_cast<std::int64_t>(engine() % 4000) - 2000; };
    cubes.push_back(make_cube(i, coordinate(), coordinate(), list));
  }
  return cubes;
}

void expect_same_up_to_file_rounding(const Model& model, const std::vector<Gdf1Cube>& cubes,
                                     double cube_size) {
  ASSERT_EQ(model.cubes.size(), cubes.size());
  EXPECT_EQ(model.counts, ModelReadCounts{});
  for (std::size_t i = 0; i < cubes.size(); ++i) {
    const Gdf1Cube& read = model.cubes[i];
    ASSERT_EQ(read.key, cubes[i].key);
    EXPECT_EQ(read.mae, cubes[i].mae);
    EXPECT_EQ(read.standard_deviation, cubes[i].standard_deviation);
    ASSERT_EQ(read.gaussians.size(), cubes[i].gaussians.size());
    const double far = 2002.0 * cube_size;
    const double ulp = far * static_cast<double>(std::numeric_limits<float>::epsilon());
    for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
      for (std::size_t k = 0; k < read.gaussians.size(); ++k) {
        const float written = cubes[i].gaussians.at(row, k);
        if (row < kRootSigmaX) {
          EXPECT_NEAR(read.gaussians.at(row, k), written, ulp);
        } else {
          EXPECT_EQ(read.gaussians.at(row, k), written);
        }
      }
    }
  }
}

TEST_F(ModelReader, ReadsBackWhatIsWrittenInBothFormats) {
  for (const double size : {0.1, 0.3, 1.0, 2.0}) {
    const auto cubes = random_cubes(size, 7);
    write_model(path("m.bin"), cubes, size);
    write_model(path("m.csv"), cubes, size);
    const Model binary = read_model(path("m.bin"));
    const Model csv = read_model(path("m.csv"));
    expect_same_up_to_file_rounding(binary, cubes, size);
    expect_same_up_to_file_rounding(csv, cubes, size);
    EXPECT_EQ(binary.header.cube_size, size);
    EXPECT_EQ(csv.header.cube_size, size);
    EXPECT_EQ(binary.header.margin, csv.header.margin);
    EXPECT_EQ(binary.header.num_cubes, csv.header.num_cubes);
    EXPECT_TRUE(binary.header.bounds.isApprox(csv.header.bounds, 1e-6));
    for (std::size_t i = 0; i < cubes.size(); ++i) {
      EXPECT_EQ(binary.cubes[i].gaussians, csv.cubes[i].gaussians);
    }
  }
}

TEST_F(ModelReader, ReadsRepresentableValuesExactly) {
  const auto cube = make_cube(-5, 7, 1000, {kFirst, kSecond});
  for (const char* name : {"m.bin", "m.csv"}) {
    write_model(path(name), {cube});
    const Model model = read_model(path(name), 1.0);
    ASSERT_EQ(model.cubes.size(), 1u);
    EXPECT_EQ(model.cubes[0].key, cube.key);
    EXPECT_EQ(model.cubes[0].gaussians, cube.gaussians);
  }
}

TEST_F(ModelReader, WritingWhatWasReadGivesTheSameBytes) {
  for (const double size : {0.1, 1.0}) {
    const auto cubes = random_cubes(size, 11);
    for (const char* name : {"m.bin", "m.csv"}) {
      write_model(path(name), cubes, size);
      const std::string bytes = read_text(path(name));
      write_model(path(name), read_model(path(name)).cubes, size);
      // Means lose the same bits only once.
      write_model(path(name), read_model(path(name)).cubes, size);
      EXPECT_EQ(read_text(path(name)), bytes);
    }
  }
}

TEST_F(ModelReader, ReadsTheHeaderAlone) {
  const auto cubes = random_cubes(0.3, 3);
  for (const char* name : {"m.bin", "m.csv"}) {
    write_model(path(name), cubes, 0.3);
    const Gdf1Header header = read_model_header(path(name));
    EXPECT_EQ(header.num_cubes, cubes.size());
    EXPECT_EQ(header.cube_size, 0.3);
    EXPECT_FLOAT_EQ(header.average_mae, 0.0125f);
    EXPECT_FLOAT_EQ(header.average_standard_deviation, 0.0625f);
    EXPECT_TRUE(header.bounds.isApprox(header_of(cubes, 0.3).bounds, 1e-6));
  }
}

TEST_F(ModelReader, TakesTheAbsoluteValueOfRootSigma) {
  write_model(path("m.bin"), {make_cube(0, 0, 0, {{0, 0, 0, -0.5f, 0.625f, -0.75f, 1}})});
  const Model model = read_model(path("m.bin"));
  ASSERT_EQ(model.cubes.size(), 1u);
  EXPECT_EQ(model.cubes[0].gaussians.at(kRootSigmaX, 0), 0.5f);
  EXPECT_EQ(model.cubes[0].gaussians.at(kRootSigmaX + 2, 0), 0.75f);
}

TEST_F(ModelReader, DropsAndCountsGaussiansThatCannotBeEvaluated) {
  const float narrow = 0.0316f;  // its square, the standard deviation, is just under 1 mm
  std::vector<Parameters> list = {kFirst};
  for (const std::size_t row : {3u, 4u, 5u}) {
    list.push_back(kFirst);
    list.back()[row] = narrow;
  }
  for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
    for (const float value : {kNan, kInfinity, -kInfinity}) {
      list.push_back(kFirst);
      list.back()[row] = value;
    }
  }
  list.push_back(kSecond);
  for (const char* name : {"m.bin", "m.csv"}) {
    write_model(path(name), {make_cube(0, 0, 0, list)});
    const Model model = read_model(path(name), 1.0);
    ASSERT_EQ(model.cubes.size(), 1u);
    EXPECT_EQ(model.cubes[0].gaussians, make_cube(0, 0, 0, {kFirst, kSecond}).gaussians);
    EXPECT_EQ(model.counts.num_dropped_gaussians, list.size() - 2);
    EXPECT_EQ(model.counts.num_dropped_cubes, 0u);
  }
}

TEST_F(ModelReader, DropsACubeWithoutAnyUsableGaussian) {
  write_model(path("m.bin"), {make_cube(0, 0, 0, {kFirst}), make_cube(1, 0, 0, {kSecond})});
  std::string bytes = read_text(path("m.bin"));
  set_value(bytes, kRootSigma, 0.0f);
  write_text(path("m.bin"), bytes);
  const Model model = read_model(path("m.bin"));
  ASSERT_EQ(model.cubes.size(), 1u);
  EXPECT_EQ(model.cubes[0].key.x, 1);
  EXPECT_EQ(model.counts, (ModelReadCounts{1, 1}));
}

TEST_F(ModelReader, KeepsTheFirstOfTwoCubesWithOneKey) {
  const std::vector<Gdf1Cube> cubes = {make_cube(4, 0, 0, {kFirst}), make_cube(5, 0, 0, {kFirst}),
                                       make_cube(4, 0, 0, {kSecond})};
  for (const char* name : {"m.bin", "m.csv"}) {
    write_model(path(name), cubes);
    const Model model = read_model(path(name));
    ASSERT_EQ(model.cubes.size(), 2u);
    EXPECT_EQ(model.cubes[0].gaussians, cubes[0].gaussians);
    EXPECT_EQ(model.counts, (ModelReadCounts{0, 1}));
    EXPECT_EQ(model.header.num_cubes, 3u);
  }
}

TEST_F(ModelReader, DropsCubesThatAreNotOnTheLattice) {
  std::vector<Gdf1Cube> cubes;
  for (std::int64_t i = 0; i < 6; ++i) cubes.push_back(make_cube(i, 0, 0, {kFirst}));
  write_model(path("m.bin"), cubes);
  std::string bytes = read_text(path("m.bin"));
  set_value(bytes, kOrigin, kNan);
  set_value(bytes, kOrigin + kCubeStride + 4, kInfinity);
  set_value(bytes, kOrigin + 2 * kCubeStride, 2.02f);
  set_value(bytes, kOrigin + 3 * kCubeStride, 3.009f);
  set_value(bytes, kOrigin + 4 * kCubeStride + 8, 1e30f);
  write_text(path("m.bin"), bytes);
  const Model model = read_model(path("m.bin"));
  ASSERT_EQ(model.cubes.size(), 2u);
  EXPECT_EQ(model.cubes[0].key.x, 3);
  EXPECT_EQ(model.cubes[1].key.x, 5);
  EXPECT_EQ(model.counts.num_dropped_cubes, 4u);
}

TEST_F(ModelReader, ReadsErrorsThatMakeNoSenseAsUnknown) {
  write_model(path("m.bin"), {make_cube(0, 0, 0, {kFirst})});
  std::string bytes = read_text(path("m.bin"));
  set_value(bytes, kOrigin + 12, -1.0f);
  set_value(bytes, kOrigin + 16, kInfinity);
  write_text(path("m.bin"), bytes);
  const Model model = read_model(path("m.bin"));
  ASSERT_EQ(model.cubes.size(), 1u);
  EXPECT_TRUE(std::isnan(model.cubes[0].mae));
  EXPECT_TRUE(std::isnan(model.cubes[0].standard_deviation));
}

/// What a CSV holds that the ancestor's trainer writes, under Windows line ends.
TEST_F(ModelReader, AcceptsTheAncestorsCsvWithCarriageReturns) {
  const std::string header =
      "CubeX,CubeY,CubeZ,MAE,StdDev,G_ID,MeanX,MeanY,MeanZ,SigmaX,SigmaY,SigmaZ,Weight\r\n";
  write_text(path("m.csv"),
             header +
                 "-3.000000,1.000000,0.000000,0.021000,0.015000,0,-2.500000,1.250000,0.500000,"
                 "0.500000,-0.600000,0.700000,1.000000\r\n"
                 "-3.000000,1.000000,0.000000,0.021000,0.015000,1,-2.500000,1.250000,0.500000,"
                 "nan,0.600000,0.700000,1.000000\r\n"
                 "-2.000000,1.000000,0.000000,0.033000,0.025000,0,-1.500000,1.250000,0.500000,"
                 "0.500000,0.600000,0.700000,2.000000\r\n\r\n");
  const Model model = read_model(path("m.csv"));
  ASSERT_EQ(model.cubes.size(), 2u);
  EXPECT_EQ(model.header.cube_size, 1.0);
  EXPECT_EQ(model.header.margin, 0.25);
  EXPECT_EQ(model.header.num_cubes, 2u);
  EXPECT_FLOAT_EQ(model.header.average_mae, 0.027f);
  EXPECT_EQ(model.cubes[0].key, (CubeKey{0, -3, 1, 0}));
  EXPECT_EQ(model.cubes[0].gaussians.size(), 1u);
  EXPECT_EQ(model.cubes[0].gaussians.at(kMeanX, 0), 0.5f);
  EXPECT_EQ(model.counts, (ModelReadCounts{1, 0}));
}

TEST_F(ModelReader, DeducesTheCubeSizeOfACsvFromFarAndSparseCubes) {
  for (const double size : {0.1, 0.25, 0.3, 1.0, 2.5, 10.0}) {
    std::vector<Gdf1Cube> cubes;
    const auto far = static_cast<std::int64_t>(6000.0 / size);
    for (const std::int64_t k : {0, 3, 5, 11, 40}) {
      cubes.push_back(make_cube(far + k, -far, k, {kFirst}));
    }
    write_model(path("m.csv"), cubes, size);
    EXPECT_EQ(read_model_header(path("m.csv")).cube_size, size);
  }
}

TEST_F(ModelReader, AsksForTheCubeSizeThatACsvDoesNotTell) {
  write_model(path("m.csv"), {make_cube(0, 0, 0, {kFirst})}, 0.5);
  const Error error = error_of([&] { (void)read_model(path("m.csv")); });
  EXPECT_EQ(error.code(), ErrorCode::kUsage);
  EXPECT_TRUE(contains(error.what(), "cube size")) << error.what();
  EXPECT_EQ(read_model(path("m.csv"), 0.5).cubes.size(), 1u);
  EXPECT_EQ(error_of([&] { (void)read_model(path("m.csv"), -1.0); }).code(), ErrorCode::kUsage);
}

TEST_F(ModelReader, NamesTheLineOfACsvThatIsNoRow) {
  write_model(path("m.csv"), {make_cube(0, 0, 0, {kFirst}), make_cube(1, 0, 0, {kFirst})});
  const std::string good = read_text(path("m.csv"));
  for (const char* const row : {"1,2,3\n", "1,0,0,0,0,0,1,1,1,1,1,x,1\n",
                                "1,0,0,0,0,0,1,1,1,1,1,1,1,1\n", "1,0,0,0,0,0,1,1,1,1,1,1,\n"}) {
    write_text(path("m.csv"), good + row);
    const Error error = error_of([&] { (void)read_model(path("m.csv")); });
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_TRUE(contains(error.what(), "m.csv: line 4: ")) << error.what();
  }
  write_text(path("m.csv"), good + std::string(100000, '1'));
  EXPECT_EQ(error_of([&] { (void)read_model(path("m.csv")); }).code(), ErrorCode::kCorrupt);
  write_text(path("m.csv"), "a,b,c\n");
  EXPECT_EQ(error_of([&] { (void)read_model(path("m.csv")); }).code(), ErrorCode::kCorrupt);
}

TEST_F(ModelReader, SaysWhichHeaderFieldItRefuses) {
  write_model(path("m.bin"), {make_cube(0, 0, 0, {kFirst})});
  const std::string good = read_text(path("m.bin"));
  const auto expect_refused = [&](std::size_t offset, auto value, const std::string& message) {
    std::string bytes = good;
    set_value(bytes, offset, value);
    write_text(path("m.bin"), bytes);
    const Error error = error_of([&] { (void)read_model_header(path("m.bin")); });
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_TRUE(contains(error.what(), path("m.bin").string() + ": ")) << error.what();
    EXPECT_TRUE(contains(error.what(), message)) << error.what();
  };
  expect_refused(0, 'X', "not a GDF1 file");
  expect_refused(4, std::uint32_t{2}, "version 2");
  expect_refused(8, std::uint32_t{4'000'000'000}, "4000000000 cubes do not fit");
  for (const float size : {0.0f, -1.0f, kNan, kInfinity}) expect_refused(44, size, "cube size");
  for (const float margin : {-0.1f, 0.6f, kNan}) expect_refused(52, margin, "margin");
}

TEST_F(ModelReader, RefusesCountsThatTheFileCannotHold) {
  write_model(path("m.bin"), {make_cube(0, 0, 0, {kFirst})});
  std::string bytes = read_text(path("m.bin"));
  set_value(bytes, kOrigin + 20, std::uint32_t{4'000'000'000});
  write_text(path("m.bin"), bytes);
  const Error error = error_of([&] { (void)read_model(path("m.bin")); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_TRUE(contains(error.what(), "cube 1 of 1: 4000000000 Gaussians")) << error.what();
}

/// The ancestor's trainer, killed, leaves a header that counts no cubes.
TEST_F(ModelReader, RefusesBytesAfterTheLastCube) {
  write_model(path("m.bin"), {make_cube(0, 0, 0, {kFirst})});
  std::string bytes = read_text(path("m.bin"));
  set_value(bytes, 8, std::uint32_t{0});
  write_text(path("m.bin"), bytes);
  const Error error = error_of([&] { (void)read_model(path("m.bin")); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_TRUE(contains(error.what(), "56 bytes after the last of 0 cubes")) << error.what();
}

TEST_F(ModelReader, FailsOnMissingFilesAndDirectories) {
  const Error missing = error_of([&] { (void)read_model(path("none.bin")); });
  EXPECT_EQ(missing.code(), ErrorCode::kIo);
  EXPECT_TRUE(contains(missing.what(), "none.bin")) << missing.what();
  std::filesystem::create_directory(path("dir.csv"));
  EXPECT_EQ(error_of([&] { (void)read_model(path("dir.csv")); }).code(), ErrorCode::kIo);
}

TEST_F(ModelReader, KeepsFarMeansAndDropsWeightsThatAreNotFinite) {
  write_model(path("m.bin"), {make_cube(0, 0, 0, {kFirst, kSecond})});
  std::string bytes = read_text(path("m.bin"));
  set_value(bytes, kWeightOffset, kNan);
  set_value(bytes, kMean + 32, 3e38f);
  write_text(path("m.bin"), bytes);
  const Model model = read_model(path("m.bin"));
  ASSERT_EQ(model.cubes.size(), 1u);
  EXPECT_EQ(model.cubes[0].gaussians.size(), 1u);
  EXPECT_EQ(model.cubes[0].gaussians.at(kMeanX, 0), 3e38f);
}

}  // namespace
}  // namespace gdfmap
