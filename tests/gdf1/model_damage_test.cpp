#include <cmath>
#include <random>

#include "model_files.hpp"

namespace gdfmap {
namespace {

using DamagedModel = ModelTest;

std::vector<Gdf1Cube> few_cubes() {
  return {make_cube(0, 0, 0, {kFirst, kSecond}), make_cube(1, 0, 0, {kSecond}),
          make_cube(1, 2, 3, {kFirst})};
}

void expect_valid(const Model& model, std::size_t file_bytes) {
  EXPECT_TRUE(std::isfinite(model.header.cube_size) && model.header.cube_size > 0.0);
  EXPECT_LE(model.cubes.size(), file_bytes / 24);
  for (const Gdf1Cube& cube : model.cubes) {
    EXPECT_EQ(cube.key.level, 0);
    EXPECT_GT(cube.gaussians.size(), 0u);
    EXPECT_LE(cube.gaussians.size(), file_bytes / 26);
    EXPECT_FALSE(cube.mae < 0.0f);
    for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
      for (const float value : cube.gaussians.row(row)) EXPECT_TRUE(std::isfinite(value));
    }
    for (std::size_t row = kRootSigmaX; row < kWeight; ++row) {
      for (const float s : cube.gaussians.row(row)) EXPECT_GE(double{s} * double{s}, 1e-3);
    }
  }
}

/// True when the bytes were read; an Error of a sensible kind is the only other way out.
bool reads_or_refuses(const std::filesystem::path& path) {
  try {
    expect_valid(read_model(path), static_cast<std::size_t>(std::filesystem::file_size(path)));
    return true;
  } catch (const Error& error) {
    EXPECT_TRUE(error.code() == ErrorCode::kCorrupt || error.code() == ErrorCode::kUsage)
        << error.what();
    EXPECT_TRUE(contains(error.what(), path.filename().string())) << error.what();
    return false;
  }
}

TEST_F(DamagedModel, IsRefusedWhereverAGdf1Ends) {
  write_model(path("m.bin"), few_cubes());
  const std::string bytes = read_text(path("m.bin"));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    write_text(path("m.bin"), bytes.substr(0, size));
    EXPECT_FALSE(reads_or_refuses(path("m.bin"))) << size << " bytes";
  }
}

TEST_F(DamagedModel, IsReadOrRefusedWhereverACsvEnds) {
  write_model(path("m.csv"), few_cubes());
  const std::string bytes = read_text(path("m.csv"));
  int num_read = 0;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    write_text(path("m.csv"), bytes.substr(0, size));
    num_read += reads_or_refuses(path("m.csv")) ? 1 : 0;
  }
  EXPECT_GE(num_read, 3);  // at least where a row is complete
  EXPECT_LT(num_read, 40);
}

void flip_and_read(const std::filesystem::path& path, int num_files, std::uint32_t seed) {
  const std::string good = read_text(path);
  std::mt19937 engine(seed);
  int num_read = 0;
  for (int i = 0; i < num_files; ++i) {
    std::string bytes = good;
    const std::uint32_t num_flips = 1 + engine() % 8;
    for (std::uint32_t flip = 0; flip < num_flips; ++flip) {
      char& byte = bytes[engine() % bytes.size()];
      byte = static_cast<char>(byte ^ (1 << engine() % 8));
    }
    write_text(path, bytes);
    num_read += reads_or_refuses(path) ? 1 : 0;
  }
  EXPECT_GT(num_read, 0);
  EXPECT_LT(num_read, num_files);
}

TEST_F(DamagedModel, IsReadOrRefusedWhicheverBitsOfAGdf1Flip) {
  write_model(path("m.bin"), few_cubes());
  flip_and_read(path("m.bin"), 3000, 1);
}

TEST_F(DamagedModel, IsReadOrRefusedWhicheverBitsOfACsvFlip) {
  write_model(path("m.csv"), few_cubes());
  flip_and_read(path("m.csv"), 3000, 2);
}

TEST_F(DamagedModel, IsRefusedWhenTheShiftedBytesFlip) {
  const Vector3 shift(1024.0, 0.0, -2048.0);
  write_model(path("m.bin"), few_cubes(), 1.0, shift);
  std::string bytes = read_text(path("m.bin"));
  for (std::size_t i = 120; i < bytes.size(); i += 7) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 1);
    write_text(path("m.bin"), damaged);
    EXPECT_FALSE(reads_or_refuses(path("m.bin")));
  }
}

TEST_F(DamagedModel, SurvivesAnySidecar) {
  write_model(path("m.bin"), few_cubes(), 1.0, Vector3(1024.0, 0.0, 0.0));
  const std::string good = read_text(path("m.bin.json"));
  std::mt19937 engine(3);
  for (int i = 0; i < 2000; ++i) {
    std::string text = good;
    text[engine() % text.size()] = static_cast<char>(engine() % 256);
    if (i % 10 == 0) text.resize(engine() % text.size());
    write_text(path("m.bin.json"), text);
    reads_or_refuses(path("m.bin"));
  }
  for (const char* const text :
       {"", "[]", "7", "{}", R"({"shift":[1,2]})", R"({"shift":[1,2,"3"]})",
        R"({"shift":[0.5,0,0]})", R"({"shift":[1e300,0,0]})", R"({"shift":"x"})",
        R"({"shift":[1024,0,0],"cube_size":2})", R"({"shift":[1024,0,0],"cube_size":-1})",
        R"({"shift":[1024,0,0],"model_digest":"00"})"}) {
    write_text(path("m.bin.json"), text);
    EXPECT_FALSE(reads_or_refuses(path("m.bin"))) << text;
  }
  write_text(path("m.bin.json"), std::string(100000, '['));
  EXPECT_FALSE(reads_or_refuses(path("m.bin")));
}

}  // namespace
}  // namespace gdfmap
