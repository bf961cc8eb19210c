// Blended value and gradient at random points of a warm field, one thread.

#include <cmath>

#include <benchmark/benchmark.h>

#include <gdfmap/query/distance_field.hpp>

namespace gdfmap {
namespace {

constexpr int kGaussians = 16;

/// A field of 4 × 4 × 4 tiles, every cube with 16 Gaussians.
std::shared_ptr<TileSource> dense_source() {
  std::vector<TileRecord> tiles;
  std::vector<OccupiedTile> occupied;
  for (int t = 0; t < 64; ++t) {
    TileRecord tile;
    tile.key = {0, t % 4, t / 4 % 4, t / 16};
    OccupiedTile occupancy{tile.key, {}};
    for (int i = 0; i < kCubesPerTile; ++i) {
      CubeRecord cube;
      cube.index = i;
      cube.gaussians = Gaussians(kGaussians);
      for (std::size_t k = 0; k < kGaussians; ++k) {
        for (std::size_t a = 0; a < 3; ++a) {
          cube.gaussians.at(kMeanX + a, k) = static_cast<float>((7 * k + 3 * a) % 16) / 16.0f;
          cube.gaussians.at(kRootSigmaX + a, k) = 0.7f;
        }
        cube.gaussians.at(kWeight, k) = 0.1f;
      }
      tile.cubes.push_back(std::move(cube));
      occupancy.cubes.set(i);
    }
    tiles.push_back(std::move(tile));
    occupied.push_back(occupancy);
  }
  return std::make_shared<MemoryTileSource>(Geometry{}, std::move(tiles), std::move(occupied));
}

/// Points of the field's interior in no order (the fractional parts of multiples of irrationals).
std::vector<Vector3> scattered_points() {
  std::vector<Vector3> points;
  for (int i = 0; i < 100'000; ++i) {
    const auto part = [&](double irrational) { return std::fmod(i * irrational, 1.0); };
    points.emplace_back(1.0 + 30.0 * part(0.7548776662), 1.0 + 30.0 * part(0.5698402910),
                        1.0 + 30.0 * part(0.4320709372));
  }
  return points;
}

void query_batch(benchmark::State& state) {
  const DistanceField field(dense_source(), {std::size_t{1} << 30, BlendMode::kPartition, 1});
  const std::vector<Vector3> points = scattered_points();
  std::vector<FieldSample> samples(points.size());
  for (auto _ : state) {
    field.at(points, samples);
    benchmark::DoNotOptimize(samples.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(points.size()));
}
BENCHMARK(query_batch)->Unit(benchmark::kMillisecond);

void query_single(benchmark::State& state) {
  const DistanceField field(dense_source(), {std::size_t{1} << 30, BlendMode::kPartition, 1});
  const std::vector<Vector3> points = scattered_points();
  std::size_t i = 0;
  for (auto _ : state) {
    auto result = field.at(points[i++ % points.size()]);
    benchmark::DoNotOptimize(result);
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(query_single);

}  // namespace
}  // namespace gdfmap
