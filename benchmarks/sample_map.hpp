#pragma once

#include <cstddef>
#include <random>

#include <gdfmap/field/quantization.hpp>
#include <gdfmap/store/tile_record.hpp>

namespace gdfmap {

/// A tile of made-up cubes, as full as those along a surface are: its first `num_cubes` cubes with
/// `num_gaussians` Gaussians each.
inline TileRecord sample_tile(const TileKey& key, int num_cubes, std::size_t num_gaussians) {
  std::mt19937 random(1);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() % 10000) / 10000.0;
  };
  const GaussianGrid& grid = GaussianGrid::fine();
  TileRecord tile{key, {{key, {1, 2}}}, {3, 4}, CubeCodec::kQuantized, 1.0, {}};
  for (int i = 0; i < num_cubes; ++i) {
    CubeRecord& cube = tile.cubes.emplace_back();
    cube.index = i;
    cube.cube_class = CubeClass::kPopulated;
    cube.errors = {0.0078125f, 0.0078125f, 0.015625f, 0.0625f};
    cube.gaussians = Gaussians(num_gaussians);
    for (std::size_t k = 0; k < num_gaussians; ++k) {
      for (std::size_t a = 0; a < 3; ++a) {
        cube.gaussians.at(kMeanX + a, k) =
            stored_mean(grid.mean_of_code(grid.mean_code(uniform(-0.2, 1.2))), 1.0);
        cube.gaussians.at(kRootSigmaX + a, k) =
            stored_root_sigma(grid.sigma_of_code(grid.sigma_code(uniform(0.16, 1.0))), 1.0);
      }
      cube.gaussians.at(kWeight, k) = static_cast<float>(uniform(-0.2, 1.2));
    }
    grid.quantize_weights(cube.gaussians);
  }
  return tile;
}

}  // namespace gdfmap
