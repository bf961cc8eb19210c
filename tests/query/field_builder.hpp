#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include <gdfmap/query/tile_source.hpp>

namespace gdfmap::test {

/// One Gaussian so wide that its cube is `value` everywhere, to 1e-9.
inline Gaussians constant_gaussians(float value) {
  Gaussians result(1);
  for (std::size_t a = 0; a < 3; ++a) result.at(kRootSigmaX + a, 0) = 300.0f;
  result.at(kWeight, 0) = value;
  return result;
}

/// A few smooth Gaussians in and around a cube of this edge.
inline Gaussians random_gaussians(std::size_t count, double edge, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  Gaussians result(count);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t a = 0; a < 3; ++a) {
      result.at(kMeanX + a, k) = static_cast<float>(edge * (1.5 * uniform(random) - 0.25));
      result.at(kRootSigmaX + a, k) =
          static_cast<float>(std::sqrt(edge * (0.3 + 0.5 * uniform(random))));
    }
    result.at(kWeight, k) = static_cast<float>(edge * (uniform(random) - 0.3));
  }
  return result;
}

/// Collects cubes one by one and hands them out as a source. Every populated cube is occupied.
class FieldBuilder {
 public:
  explicit FieldBuilder(const Geometry& geometry) : geometry_(geometry) {}

  FieldBuilder& add(const CubeKey& key, Gaussians gaussians,
                    CubeStatus status = CubeStatus::kFitted, float mae = 0.01f) {
    CubeRecord cube;
    cube.index = cube_index_in_tile(key);
    cube.status = status;
    cube.errors.mae = mae;
    cube.errors.max = 2.0f * mae;
    if (status == CubeStatus::kFailed) {
      cube.failure = FailureReason::kNotFinite;
    } else {
      cube.gaussians = std::move(gaussians);
    }
    cubes_[key] = std::move(cube);
    return *this;
  }
  FieldBuilder& occupy(const CubeKey& key) {
    const TileKey tile = tile_of(key);
    occupied_.try_emplace(tile, OccupiedTile{tile, {}})
        .first->second.cubes.set(cube_index_in_tile(key));
    return *this;
  }

  [[nodiscard]] const Geometry& geometry() const { return geometry_; }
  [[nodiscard]] const std::map<CubeKey, CubeRecord>& cubes() const { return cubes_; }

  [[nodiscard]] std::vector<TileRecord> tiles() const {
    std::map<TileKey, TileRecord> tiles;
    for (const auto& [key, cube] : cubes_) {
      TileRecord& tile = tiles[tile_of(key)];
      tile.key = tile_of(key);
      tile.cubes.push_back(cube);
    }
    std::vector<TileRecord> result;
    for (auto& [key, tile] : tiles) {
      std::ranges::sort(tile.cubes, {}, &CubeRecord::index);
      result.push_back(std::move(tile));
    }
    return result;
  }
  [[nodiscard]] std::vector<OccupiedTile> occupied() const {
    std::vector<OccupiedTile> result;
    for (const auto& [key, tile] : occupied_) result.push_back(tile);
    return result;
  }
  [[nodiscard]] std::shared_ptr<MemoryTileSource> source() const {
    return std::make_shared<MemoryTileSource>(geometry_, tiles(), occupied());
  }

 private:
  Geometry geometry_;
  std::map<CubeKey, CubeRecord> cubes_;
  std::map<TileKey, OccupiedTile> occupied_;
};

/// A block of random cubes around the world's origin, a part of them missing; with two levels, the
/// coarse one covers it all.
inline FieldBuilder random_block(int num_levels, double missing, std::uint32_t seed,
                                 double cube_size = 1.0) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  FieldBuilder builder({cube_size, kMarginRatio * cube_size, num_levels});
  const auto fill = [&](int level, std::int64_t low, std::int64_t high, double hole) {
    const double edge = cube_size * static_cast<double>(level_scale(level));
    for (std::int64_t x = low; x < high; ++x) {
      for (std::int64_t y = low; y < high; ++y) {
        for (std::int64_t z = low; z < high; ++z) {
          if (uniform(random) < hole) continue;
          const auto status = uniform(random) < 0.2 ? CubeStatus::kPoor : CubeStatus::kFitted;
          builder.add({level, x, y, z}, random_gaussians(3, edge, random), status,
                      static_cast<float>(uniform(random)));
        }
      }
    }
  };
  fill(0, -3, 3, missing);
  if (num_levels > 1) fill(1, -2, 2, 0.0);
  builder.occupy({0, 0, 0, 0}).occupy({0, -2, 1, -1});
  return builder;
}

}  // namespace gdfmap::test
