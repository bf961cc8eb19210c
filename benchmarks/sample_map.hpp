#pragma once

#include <cstddef>
#include <random>

#include <gdfmap/store/tile_record.hpp>

namespace gdfmap {

/// A tile of made-up cubes, as full as those along a surface are: its first `num_cubes` cubes with
/// `num_gaussians` Gaussians each.
inline TileRecord sample_tile(const TileKey& key, int num_cubes, std::size_t num_gaussians) {
  std::mt19937 random(1);
  const auto uniform = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(random() % 10000) / 10000.0f;
  };
  TileRecord tile{key, {1, 2}, {3, 4}, CubeCodec::kFloat32, 0.0, {}};
  for (int i = 0; i < num_cubes; ++i) {
    CubeRecord& cube = tile.cubes.emplace_back();
    cube.index = i;
    cube.errors = {0.01f, 0.01f, 0.02f, 0.05f};
    cube.gaussians = Gaussians(num_gaussians);
    for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
      const bool is_root_sigma = row >= kRootSigmaX && row < kWeight;
      for (float& value : cube.gaussians.row(row)) {
        value = is_root_sigma ? uniform(0.4f, 1.0f) : uniform(-0.2f, 1.2f);
      }
    }
  }
  return tile;
}

}  // namespace gdfmap
