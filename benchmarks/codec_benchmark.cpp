// Blocks of surface points in and out: points a second and bytes a point.

#include <algorithm>

#include <benchmark/benchmark.h>

#include <gdfmap/pipeline/synthetic_scene.hpp>
#include <gdfmap/tiling/block_codec.hpp>

namespace gdfmap {
namespace {

/// A full block of points on a sphere of 3 m within one tile of 8 m.
std::vector<TileOffset> surface_points() {
  const SyntheticScene scene("sphere", 6.0);
  const Box3& bounds = scene.bounds();
  std::vector<TileOffset> points;
  for (std::uint64_t i = 0; i < kMaxBlockPoints; ++i) {
    const Vector3 p = (scene.sample(i, 1, 0.0) - bounds.min()) * (kStepsPerTileAxis / 8.0);
    const auto step = [](double v) { return static_cast<std::uint16_t>(std::max(v, 0.0)); };
    points.push_back({step(p.x()), step(p.y()), step(p.z())});
  }
  return points;
}

void count_points(benchmark::State& state, std::size_t points, std::size_t bytes) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(points));
  state.counters["bytes_per_point"] = static_cast<double>(bytes) / static_cast<double>(points);
}

void sort_and_encode(benchmark::State& state) {
  const std::vector<TileOffset> unsorted = surface_points();
  std::size_t bytes = 0;
  for (auto _ : state) {
    std::vector<TileOffset> points = unsorted;
    sort_unique(points);
    bytes = encode_block(points).size();
  }
  count_points(state, unsorted.size(), bytes);
}
BENCHMARK(sort_and_encode);

void decode(benchmark::State& state) {
  std::vector<TileOffset> points = surface_points();
  sort_unique(points);
  const Bytes block = encode_block(points);
  for (auto _ : state) {
    auto result = decode_block(block);
    benchmark::DoNotOptimize(result);
  }
  count_points(state, points.size(), block.size());
}
BENCHMARK(decode);

}  // namespace
}  // namespace gdfmap
