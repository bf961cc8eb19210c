#include <filesystem>

#include <benchmark/benchmark.h>

#include <gdfmap/pipeline/field_access.hpp>
#include <gdfmap/pipeline/surface.hpp>
#include <gdfmap/train/train.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

/// A furnished room of 4 × 4 m, trained.
std::shared_ptr<TileSource> room() {
  static const test::TemporaryDirectory directory;
  static const std::shared_ptr<TileSource> source = [] {
    Map map = test::map_of(directory / "room.gdfmap", test::scene_points("room", 300'000, 4.0));
    train(map);
    return open_tile_source(directory / "room.gdfmap");
  }();
  return source;
}

const RunContext kOneThread{.num_threads = 1, .memory_bytes = std::size_t{1} << 30};

void surface_points(benchmark::State& state) {
  const test::TemporaryDirectory directory;
  SurfacePointsOptions options;
  options.project = state.range(0) == 1;
  const auto source = room();
  std::int64_t num_samples = 0;
  for (auto _ : state) {
    const auto report = write_surface_points(source, options, directory / "points.ply", kOneThread);
    num_samples += static_cast<std::int64_t>(report.num_samples);
  }
  state.SetItemsProcessed(num_samples);
}
BENCHMARK(surface_points)->ArgName("project")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

/// What the tensor product is for: the same samples, asked for as points.
void samples_as_points(benchmark::State& state) {
  const DistanceField field(room(), {.num_threads = 1});
  std::vector<Vector3> points;
  for (int z = 0; z < 50; ++z) {
    for (int y = 0; y < 50; ++y) {
      for (int x = 0; x < 50; ++x) points.emplace_back(0.02 * x, 0.02 * y, 0.02 * z);
    }
  }
  std::vector<double> distances(points.size());
  for (auto _ : state) field.distances(points, distances);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(points.size()));
}
BENCHMARK(samples_as_points)->Unit(benchmark::kMillisecond);

void surface_mesh(benchmark::State& state) {
  const test::TemporaryDirectory directory;
  const auto source = room();
  std::int64_t num_triangles = 0;
  for (auto _ : state) {
    const auto report = write_surface_mesh(source, {}, directory / "mesh.ply", kOneThread);
    num_triangles += static_cast<std::int64_t>(report.num_triangles);
  }
  state.SetItemsProcessed(num_triangles);
}
BENCHMARK(surface_mesh)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gdfmap
