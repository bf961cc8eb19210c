// Exact distances: building the index and looking up a cube's 12³ samples, beside nanoflann.

#include <cstdint>

#include <benchmark/benchmark.h>
#include <nanoflann.hpp>

#include <gdfmap/edt/nearest_point_index.hpp>
#include <gdfmap/edt/sample_lattice.hpp>
#include <gdfmap/pipeline/synthetic_scene.hpp>

namespace gdfmap {
namespace {

using Points = std::vector<NearestPointIndex::Point>;
using Samples = std::vector<Eigen::Vector3i>;

/// Points of a room of 6 m, in steps from its corner.
Points room_points(std::size_t count) {
  const SyntheticScene scene("room", 6.0);
  const Vector3 corner = scene.bounds().min();
  Points points;
  for (std::uint64_t i = 0; i < count; ++i) {
    const Vector3 p = (scene.sample(i, 1, 0.0) - corner) * kStepsPerCubeAxis;
    NearestPointIndex::Point point;
    for (std::size_t a = 0; a < 3; ++a) {
      point[a] = static_cast<std::uint16_t>(
          std::clamp(std::round(p[static_cast<Eigen::Index>(a)]), 0.0, 65535.0));
    }
    points.push_back(point);
  }
  return points;
}

/// The samples of 27 neighbouring cubes in the middle, in packets of 4 × 4 × 4.
Samples samples() {
  constexpr int kPackets = 3 * kPopulatedGrid.per_edge / 4;
  Samples result;
  for (int packet = 0; packet < kPackets * kPackets * kPackets; ++packet) {
    for (int i = 0; i < 64; ++i) {
      // Morton order within the packet.
      const auto at = [&](int p, int bit) {
        const int n = 4 * p + (i >> bit & 1) + 2 * (i >> (bit + 3) & 1);
        return static_cast<int>(kStepsPerCubeAxis +
                                kPopulatedGrid.offset(n + kPopulatedGrid.margin, 0));
      };
      result.emplace_back(at(packet / (kPackets * kPackets), 2),
                          at(packet / kPackets % kPackets, 1), at(packet % kPackets, 0));
    }
  }
  return result;
}

struct Adaptor {
  const Points& points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][axis];
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

void query_index(benchmark::State& state, SampleOrder order) {
  const NearestPointIndex index(room_points(1'000'000));
  const Samples places = samples();
  for (auto _ : state) {
    std::vector<SamplePacket> packets = make_packets(places);
    index.update(packets, Eigen::Vector3f::Zero(), order);
    benchmark::DoNotOptimize(packets);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(places.size()));
}
BENCHMARK_CAPTURE(query_index, packets, SampleOrder::kPackets)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(query_index, scattered, SampleOrder::kScattered)->Unit(benchmark::kMillisecond);

void query_nanoflann(benchmark::State& state) {
  const Points points = room_points(1'000'000);
  const Adaptor adaptor{points};
  KdTree tree(3, adaptor);
  tree.buildIndex();
  const Samples places = samples();
  for (auto _ : state) {
    for (const Eigen::Vector3i& place : places) {
      const Eigen::Vector3f p = place.cast<float>();
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
