#include <cstdint>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/query/decoded_tile.hpp>

#include "field_builder.hpp"

namespace gdfmap {
namespace {

TileRecord tile_with_every_kind() {
  std::mt19937 random(1);
  const auto gaussians = [&](std::size_t count) {
    return test::random_gaussians(count, 1.0, random);
  };
  test::FieldBuilder builder({});
  builder.add({0, 0, 0, 0}, gaussians(3), CubeStatus::kFitted, 0.5f);
  builder.add({0, 1, 0, 0}, gaussians(16), CubeStatus::kPoor);
  builder.add({0, 2, 0, 0}, {}, CubeStatus::kFailed);
  builder.add({0, 7, 7, 7}, gaussians(8));
  return builder.tiles()[0];
}

TEST(DecodedTile, FindsCubesByTheirIndex) {
  const DecodedTile tile(tile_with_every_kind());
  EXPECT_EQ(tile.num_cubes(), 4u);
  EXPECT_EQ(tile.find(3), nullptr);
  ASSERT_NE(tile.find(0), nullptr);
  EXPECT_EQ(tile.find(0)->mae, 0.5f);
  EXPECT_EQ(tile.find(0)->max_error, 1.0f);
  EXPECT_EQ(tile.find(1)->status, CubeStatus::kPoor);
  EXPECT_EQ(tile.find_served(1), tile.find(1));
  EXPECT_EQ(tile.find(2)->status, CubeStatus::kFailed);
  EXPECT_EQ(tile.find_served(2), nullptr);
  EXPECT_EQ(tile.find(511)->count, 8u);
}

TEST(DecodedTile, EvaluatesAsTheCubesThatItHolds) {
  const TileRecord record = tile_with_every_kind();
  const DecodedTile tile(record);
  const Vector3 p(0.3, 0.6, 0.9);
  for (const CubeRecord& cube : record.cubes) {
    if (cube.status == CubeStatus::kFailed) continue;
    const Kernel kernel(cube.gaussians);
    EXPECT_EQ(evaluate(tile.kernel(*tile.find(cube.index)), p), evaluate(kernel.view(), p));
  }
}

TEST(DecodedTile, AlignsRowsAndCubesAndFillsTheGapsWithNothing) {
  const DecodedTile tile(tile_with_every_kind());
  const auto address = [](const float* p) { return reinterpret_cast<std::uintptr_t>(p); };
  for (const int index : {0, 1, 511}) {
    KernelView kernel = tile.kernel(*tile.find(index));
    for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
      EXPECT_EQ(address(kernel.row(row)) % 32, 0u);
    }
    const double exact = evaluate(kernel, Vector3::Zero());
    kernel.count = kernel.stride;
    EXPECT_EQ(kernel.count % 8, 0u);
    EXPECT_EQ(evaluate(kernel, Vector3::Zero()), exact);
  }
}

TEST(DecodedTile, HoldsATileWithoutCubes) {
  const DecodedTile tile{TileRecord{}};
  EXPECT_EQ(tile.num_cubes(), 0u);
  EXPECT_EQ(tile.find(0), nullptr);
}

}  // namespace
}  // namespace gdfmap
