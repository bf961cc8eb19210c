#pragma once

#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/gdf1/model.hpp>

namespace gdfmap {

/// A directory of its own for every test, removed with it.
class ModelTest : public ::testing::Test {
 protected:
  ModelTest() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    directory_ = std::filesystem::path(::testing::TempDir()) /
                 ("gdf1_" + std::to_string(::getpid()) + "_" + info->name());
    std::filesystem::create_directories(directory_);
  }
  ~ModelTest() override { std::filesystem::remove_all(directory_); }

  [[nodiscard]] std::filesystem::path path(const std::string& name) const {
    return directory_ / name;
  }

  std::filesystem::path directory_;
};

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_text(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::remove(path);  // file systems flush files that are written over
  std::ofstream(path, std::ios::binary) << text;
}

/// One Gaussian: mean, root sigma, weight.
using Parameters = std::array<float, kNumGaussianRows>;

inline Gdf1Cube make_cube(std::int64_t x, std::int64_t y, std::int64_t z,
                          const std::vector<Parameters>& list) {
  Gdf1Cube cube{{0, x, y, z}, 0.0125f, 0.0625f, Gaussians(list.size())};
  for (std::size_t k = 0; k < list.size(); ++k) {
    for (std::size_t row = 0; row < kNumGaussianRows; ++row)
      cube.gaussians.at(row, k) = list[k][row];
  }
  return cube;
}

inline constexpr Parameters kFirst = {0.25f, 0.5f, 0.75f, 0.5f, 0.625f, 0.75f, 1.5f};
inline constexpr Parameters kSecond = {-0.125f, 1.125f, 0.0f, 1.0f, 1.25f, 0.375f, -2.5f};

inline Gdf1Header header_of(const std::vector<Gdf1Cube>& cubes, double cube_size) {
  Gdf1Header header;
  header.num_cubes = static_cast<std::uint32_t>(cubes.size());
  header.average_mae = 0.0125f;
  header.average_standard_deviation = 0.0625f;
  for (const Gdf1Cube& cube : cubes) header.bounds.extend(Lattice(cube_size).cube_box(cube.key));
  header.cube_size = cube_size;
  header.margin = kMarginRatio * cube_size;
  return header;
}

inline void write_model(const std::filesystem::path& path, const std::vector<Gdf1Cube>& cubes,
                        double cube_size = 1.0, const Vector3& shift = Vector3::Zero(),
                        const Digest& digest = {}) {
  const auto writer = create_model(path, cube_size, shift, digest);
  for (const Gdf1Cube& cube : cubes) writer->write(cube);
  writer->finish(header_of(cubes, cube_size));
}

/// The error that a call throws; fails the test where it throws none.
template <typename Function>
Error error_of(const Function& function) {
  try {
    function();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return {ErrorCode::kInternal, "no error"};
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

template <typename T>
T value_at(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

template <typename T>
void set_value(std::string& bytes, std::size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(T));
}

}  // namespace gdfmap
