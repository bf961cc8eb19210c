#pragma once

#include <cmath>
#include <cstddef>
#include <memory>
#include <random>
#include <vector>

#include <gdfmap/query/tile_source.hpp>

namespace gdfmap {

/// A tile of random smooth cubes as the balanced preset fits them near surfaces: all 512 or the
/// first few, 12 Gaussians on average (8 or 16).
inline TileRecord balanced_tile(const TileKey& key, int num_cubes, std::mt19937& random) {
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  TileRecord tile;
  tile.key = key;
  for (int i = 0; i < num_cubes; ++i) {
    CubeRecord& cube = tile.cubes.emplace_back();
    cube.index = i;
    cube.errors = {0.01f, 0.01f, 0.02f, 0.05f};
    cube.gaussians = Gaussians(i % 2 == 0 ? 8 : 16);
    for (std::size_t k = 0; k < cube.gaussians.size(); ++k) {
      for (std::size_t a = 0; a < 3; ++a) {
        cube.gaussians.at(kMeanX + a, k) = 1.5f * uniform(random) - 0.25f;
        cube.gaussians.at(kRootSigmaX + a, k) = std::sqrt(0.2f + 0.6f * uniform(random));
      }
      cube.gaussians.at(kWeight, k) = uniform(random) - 0.3f;
    }
  }
  return tile;
}

/// 4 × 4 × 4 full tiles, 32,768 cubes, from the origin on.
inline std::shared_ptr<TileSource> balanced_block() {
  std::mt19937 random(1);
  std::vector<TileRecord> tiles;
  for (int t = 0; t < 64; ++t) {
    tiles.push_back(balanced_tile({0, t % 4, t / 4 % 4, t / 16}, kCubesPerTile, random));
  }
  auto occupied = cubes_as_occupied(tiles);
  return std::make_shared<MemoryTileSource>(Geometry{}, std::move(tiles), std::move(occupied));
}

inline std::vector<Vector3> random_points(const Box3& box, std::size_t count) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<Vector3> points(count);
  for (Vector3& p : points) {
    p = box.min() +
        Vector3(uniform(random), uniform(random), uniform(random)).cwiseProduct(box.sizes());
  }
  return points;
}

/// Places a millimetre apart on a winding line through the box.
inline std::vector<Vector3> trajectory(const Box3& box, std::size_t count) {
  std::vector<Vector3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double s = 1e-3 * static_cast<double>(i) / box.sizes().x();
    const Vector3 wave(std::sin(1.5 * s), std::cos(0.9 * s), std::sin(0.6 * s));
    points.push_back(box.center() + 0.45 * wave.cwiseProduct(box.sizes()));
  }
  return points;
}

/// A turn of a LiDAR with 64 beams in a room of 24 × 24 × 10 m, in the order of a scanner: all
/// beams of a direction, then the next one.
inline std::vector<Vector3> lidar_scan(const Vector3& sensor, std::size_t count) {
  constexpr std::size_t kBeams = 64;
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 0.02);
  std::vector<Vector3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double turn =
        2.0 * M_PI * static_cast<double>(i / kBeams) / (static_cast<double>(count) / kBeams);
    const double rise =
        (-25.0 + 40.0 * static_cast<double>(i % kBeams) / (kBeams - 1)) * M_PI / 180.0;
    const Vector3 direction(std::cos(rise) * std::cos(turn), std::cos(rise) * std::sin(turn),
                            std::sin(rise));
    const double range =
        (Vector3(12.0, 12.0, 5.0).array() / direction.array().abs().max(1e-9)).minCoeff();
    points.push_back(sensor + (range + noise(random)) * direction);
  }
  return points;
}

}  // namespace gdfmap
