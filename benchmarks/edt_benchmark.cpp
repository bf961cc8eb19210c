// Exact distances: building the index and looking up a cube's 12³ samples, beside nanoflann.

#include <cstdint>
#include <limits>

#include <benchmark/benchmark.h>
#include <nanoflann.hpp>

#include <gdfmap/edt/nearest_point_index.hpp>
#include <gdfmap/edt/sample_lattice.hpp>
#include <gdfmap/pipeline/synthetic_scene.hpp>

namespace gdfmap {
namespace {

using Points = std::vector<Eigen::Vector3f>;

/// Points of a room of 6 m, in steps from its corner.
Points room_points(std::size_t count) {
  const SyntheticScene scene("room", 6.0);
  const Vector3 corner = scene.bounds().min();
  Points points;
  for (std::uint64_t i = 0; i < count; ++i) {
    points.push_back(((scene.sample(i, 1, 0.0) - corner) * kStepsPerCubeAxis)
                         .array()
                         .round()
                         .max(0.0)
                         .min(65535.0)
                         .cast<float>());
  }
  return points;
}

/// The samples of 27 neighbouring cubes in the middle, cube by cube.
Points samples() {
  Points result;
  for (int cube = 0; cube < 27; ++cube) {
    for (int n = 0; n < kNumSamples; ++n) {
      constexpr int k = kSamplesPerAxis;
      const auto at = [&](int c, int i) {
        return static_cast<float>((c + 1) * kStepsPerCubeAxis + sample_offset(i, 0));
      };
      result.emplace_back(at(cube % 3, n / (k * k)), at(cube / 3 % 3, n / k % k),
                          at(cube / 9, n % k));
    }
  }
  return result;
}

struct Adaptor {
  const Points& points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using KdTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Adaptor>, Adaptor, 3>;

void build_index(benchmark::State& state) {
  const Points points = room_points(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) {
    auto result = NearestPointIndex(points);
    benchmark::DoNotOptimize(result);
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(build_index)->Arg(1'000'000)->Unit(benchmark::kMillisecond);

void build_nanoflann(benchmark::State& state) {
  const Points points = room_points(static_cast<std::size_t>(state.range(0)));
  const Adaptor adaptor{points};
  for (auto _ : state) {
    KdTree tree(3, adaptor);
    tree.buildIndex();
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(build_nanoflann)->Arg(1'000'000)->Unit(benchmark::kMillisecond);

void query_index(benchmark::State& state) {
  const NearestPointIndex index(room_points(1'000'000));
  const Points places = samples();
  for (auto _ : state) {
    std::vector<float> best(places.size(), std::numeric_limits<float>::infinity());
    index.update(places, best);
    benchmark::DoNotOptimize(best);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(places.size()));
}
BENCHMARK(query_index)->Unit(benchmark::kMillisecond);

void query_nanoflann(benchmark::State& state) {
  const Points points = room_points(1'000'000);
  const Adaptor adaptor{points};
  KdTree tree(3, adaptor);
  tree.buildIndex();
  const Points places = samples();
  for (auto _ : state) {
    for (const Eigen::Vector3f& p : places) {
      std::uint32_t nearest = 0;
      float squared = 0.0f;
      tree.knnSearch(p.data(), 1, &nearest, &squared);
      benchmark::DoNotOptimize(squared);
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(places.size()));
}
BENCHMARK(query_nanoflann)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gdfmap
