#pragma once

#include <cstdint>
#include <limits>
#include <random>

#include <gdfmap/store/tile_record.hpp>

namespace gdfmap::test {

/// A cube with made-up but valid contents, the same for the same arguments.
inline CubeRecord sample_cube(int index, std::size_t num_gaussians, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto uniform = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(random() % 10000) / 10000.0f;
  };
  CubeRecord cube;
  cube.index = index;
  cube.cube_class = random() % 2 == 0 ? CubeClass::kEmpty : CubeClass::kPopulated;
  cube.num_iterations = static_cast<int>(random() % 100);
  cube.errors = {uniform(0.0f, 0.1f), uniform(0.0f, 0.1f), uniform(0.0f, 0.2f),
                 uniform(0.0f, 0.5f)};
  cube.reach = uniform(0.0f, 3.0f);
  cube.input = random() & kMaxInputDigest;
  cube.gaussians = Gaussians(num_gaussians);
  for (std::size_t k = 0; k < num_gaussians; ++k) {
    for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
      const bool is_root_sigma = row >= kRootSigmaX && row < kWeight;
      cube.gaussians.at(row, k) = is_root_sigma ? uniform(0.1f, 1.0f) : uniform(-1.0f, 2.0f);
    }
  }
  return cube;
}

inline CubeRecord failed_cube(int index) {
  CubeRecord cube;
  cube.index = index;
  cube.status = CubeStatus::kFailed;
  cube.failure = FailureReason::kNotFinite;
  const float unknown = std::numeric_limits<float>::quiet_NaN();
  cube.errors = {unknown, unknown, unknown, unknown};
  return cube;
}

/// Four cubes: one poor, one failed.
inline TileRecord sample_tile(const TileKey& key, std::uint32_t seed) {
  TileRecord tile;
  tile.key = key;
  TileKey beside = key;
  --beside.x;
  tile.surroundings = {{beside, {seed, 1}}, {key, {seed, 2}}};
  tile.configuration = {seed, 2};
  tile.cubes = {sample_cube(0, 8, seed + 1), sample_cube(7, 16, seed + 2), failed_cube(100),
                sample_cube(511, 3, seed + 3)};
  tile.cubes[1].status = CubeStatus::kPoor;
  return tile;
}

inline void round_to_grid(Gaussians& g, const GaussianGrid& grid, double edge) {
  for (std::size_t k = 0; k < g.size(); ++k) {
    for (std::size_t a = 0; a < 3; ++a) {
      const double mean = g.at(kMeanX + a, k), root_sigma = g.at(kRootSigmaX + a, k);
      g.at(kMeanX + a, k) = stored_mean(grid.mean_of_code(grid.mean_code(mean / edge)), edge);
      g.at(kRootSigmaX + a, k) = stored_root_sigma(
          grid.sigma_of_code(grid.sigma_code(root_sigma * root_sigma / edge)), edge);
    }
  }
  grid.quantize_weights(g);
}

/// sample_tile() with everything on the grid of the quantised codec.
inline TileRecord quantized_tile(double edge) {
  TileRecord tile = sample_tile({0, 1, 2, 3}, 5);
  tile.codec = CubeCodec::kQuantized;
  tile.cube_edge = edge;
  const LengthGrid lengths(edge);
  for (CubeRecord& cube : tile.cubes) {
    for (float* const value :
         {&cube.errors.mae, &cube.errors.rmse, &cube.errors.p95, &cube.errors.max, &cube.reach}) {
      *value = lengths.of_code(lengths.nearest(*value));
    }
    round_to_grid(cube.gaussians, gaussian_grid(cube.cube_class == CubeClass::kEmpty), edge);
  }
  return tile;
}

}  // namespace gdfmap::test
