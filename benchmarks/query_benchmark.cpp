// Answers of a field, one thread. Random points and coherent ones in a block of cubes with 12
// Gaussians on average; a trained room against nearest neighbours in its cloud; cold tiles; a map
// ten times as large as the cache.

#include <array>
#include <filesystem>
#include <fstream>

#include <benchmark/benchmark.h>
#include <malloc.h>
#include <nanoflann.hpp>
#include <unistd.h>

#include <gdfmap/pipeline/field_access.hpp>
#include <gdfmap/query/distance_field.hpp>
#include <gdfmap/query/path_queries.hpp>
#include <gdfmap/train/train.hpp>

#include "query_scene.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

constexpr std::size_t kNumPoints = 100'000;
const Box3 kInside(Vector3::Constant(1.0), Vector3::Constant(31.0));

DistanceFieldOptions warm(Precision precision = Precision::kFloat,
                          InstructionSet set = best_instruction_set()) {
  DistanceFieldOptions options;
  options.cache_bytes = std::size_t{1} << 30;
  options.num_threads = 1;
  options.precision = precision;
  options.instruction_set = set;
  return options;
}

void count_points(benchmark::State& state, std::size_t per_iteration) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(per_iteration));
}

void answer_batches(benchmark::State& state, const DistanceField& field,
                    const std::vector<Vector3>& points) {
  std::vector<FieldSample> samples(points.size());
  field.at(points, samples);
  for (auto _ : state) {
    field.at(points, samples);
    benchmark::DoNotOptimize(samples.data());
  }
  count_points(state, points.size());
}

void query_gradients(benchmark::State& state, const std::vector<Vector3>& points) {
  answer_batches(state, DistanceField(balanced_block(), warm()), points);
}
BENCHMARK_CAPTURE(query_gradients, random, random_points(kInside, kNumPoints))
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(query_gradients, trajectory, trajectory(kInside, kNumPoints))
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(query_gradients, lidar_scan, lidar_scan(kInside.center(), kNumPoints))
    ->Unit(benchmark::kMillisecond);

void query_values(benchmark::State& state, const std::vector<Vector3>& points) {
  const DistanceField field(balanced_block(), warm());
  std::vector<double> distances(points.size());
  field.distances(points, distances);
  for (auto _ : state) {
    field.distances(points, distances);
    benchmark::DoNotOptimize(distances.data());
  }
  count_points(state, points.size());
}
BENCHMARK_CAPTURE(query_values, random, random_points(kInside, kNumPoints))
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(query_values, lidar_scan, lidar_scan(kInside.center(), kNumPoints))
    ->Unit(benchmark::kMillisecond);

void query_instruction_set(benchmark::State& state, Precision precision, InstructionSet set) {
  if (!is_supported(set)) return state.SkipWithError("not supported here");
  answer_batches(state, DistanceField(balanced_block(), warm(precision, set)),
                 random_points(kInside, kNumPoints));
}
BENCHMARK_CAPTURE(query_instruction_set, avx512, Precision::kFloat, InstructionSet::kAvx512)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(query_instruction_set, avx2, Precision::kFloat, InstructionSet::kAvx2)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(query_instruction_set, portable, Precision::kFloat, InstructionSet::kPortable)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(query_instruction_set, double_precision, Precision::kDouble,
                  InstructionSet::kPortable)
    ->Unit(benchmark::kMillisecond);

void query_single(benchmark::State& state) {
  const DistanceField field(balanced_block(), warm());
  const std::vector<Vector3> points = random_points(kInside, kNumPoints);
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(field.at(points[i++ % points.size()]));
  count_points(state, 1);
}
BENCHMARK(query_single);

/// A room of 2 million points and its map, trained once with the default preset.
struct Room {
  static constexpr std::size_t kCloudPoints = 2'000'000;
  test::TemporaryDirectory directory;
  std::vector<Vector3> cloud = test::scene_points("room", kCloudPoints);
  std::vector<Vector3> queries =
      random_points(Box3(Vector3(-4, -4, 0.2), Vector3(4, 4, 2.8)), kNumPoints);

  Room() {
    Map map = test::map_of(directory / "room.gdfmap", cloud);
    train(map);
  }
  [[nodiscard]] std::shared_ptr<TileSource> source() const {
    return open_tile_source(directory / "room.gdfmap");
  }
  static const Room& get() {
    static const Room room;
    return room;
  }
};

void query_room_field(benchmark::State& state) {
  answer_batches(state, DistanceField(Room::get().source(), warm()), Room::get().queries);
}
BENCHMARK(query_room_field)->Unit(benchmark::kMillisecond);

struct CloudAdaptor {
  const std::vector<Vector3>& points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  [[nodiscard]] bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

void query_room_nanoflann(benchmark::State& state) {
  const CloudAdaptor adaptor{Room::get().cloud};
  using Tree =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, CloudAdaptor>,
                                          CloudAdaptor, 3>;
  const Tree tree(3, adaptor);
  const std::vector<Vector3>& queries = Room::get().queries;
  std::size_t i = 0;
  for (auto _ : state) {
    std::uint32_t index = 0;
    double squared = 0.0;
    tree.knnSearch(queries[i++ % queries.size()].data(), 1, &index, &squared);
    benchmark::DoNotOptimize(squared);
  }
  count_points(state, 1);
}
BENCHMARK(query_room_nanoflann);

void query_room_rays(benchmark::State& state) {
  const DistanceField field(Room::get().source(), warm());
  std::vector<Ray> rays;
  for (const Vector3& p : lidar_scan(Vector3::Zero(), 10'000)) rays.push_back({{0, 0, 1.5}, p});
  RayOptions options;
  options.max_range = 20.0;
  for (auto _ : state) benchmark::DoNotOptimize(cast_rays(field, rays, options));
  count_points(state, rays.size());
}
BENCHMARK(query_room_rays)->Unit(benchmark::kMillisecond);

/// A cubes.db with a floor of n × n tiles of 256 cubes.
std::shared_ptr<TileSource> store_of(const test::TemporaryDirectory& directory, int n) {
  std::mt19937 random(1);
  CubeStore store(directory / "cubes.db", db::OpenMode::kCreate);
  std::vector<OccupiedTile> occupied;
  for (int x = 0; x < n; ++x) {
    std::vector<TileRecord> row;
    for (int y = 0; y < n; ++y) row.push_back(balanced_tile({0, x, y, 0}, 256, random));
    store.put(row);
    for (const OccupiedTile& tile : cubes_as_occupied(row)) occupied.push_back(tile);
  }
  store.set_occupied(occupied);
  return std::make_shared<StoreTileSource>(directory / "cubes.db", Geometry{});
}

/// Read, checked and decoded, the file in the system's cache.
void query_cold_tile(benchmark::State& state) {
  const test::TemporaryDirectory directory;
  TileCache cache(store_of(directory, 4), 0);
  int i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(cache.get({0, i % 4, i / 4 % 4, 0}));
    ++i;
  }
}
BENCHMARK(query_cold_tile)->Unit(benchmark::kMicrosecond);

double resident_mib() {
  std::ifstream statm("/proc/self/statm");
  double size = 0.0, resident = 0.0;
  statm >> size >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// A sensor drives through 40 × 40 tiles of a map, ten times what the cache holds, and every scan
/// is answered.
void query_map_larger_than_cache(benchmark::State& state) {
  const test::TemporaryDirectory directory;
  const auto source = store_of(directory, 40);
  DistanceFieldOptions options = warm();
  options.cache_bytes = std::size_t{19} << 20;
  const DistanceField field(source, options);
  std::vector<FieldSample> samples(kNumPoints / 10);
  ::malloc_trim(0);  // what earlier benchmarks left behind would hide growth
  const double before = resident_mib();
  double most = before, step = 0.0;
  for (auto _ : state) {
    const double turn = 0.005 * step++;
    const Vector3 sensor(160.0 + 130.0 * std::sin(turn), 160.0 + 130.0 * std::cos(1.3 * turn), 2.0);
    const std::vector<Vector3> scan = lidar_scan(sensor, samples.size());
    field.at(scan, samples);
    most = std::max(most, resident_mib());
  }
  count_points(state, samples.size());
  state.counters["hit_rate"] = field.statistics().hit_rate();
  state.counters["loads_per_scan"] = static_cast<double>(field.statistics().loads) / step;
  state.counters["grown_mib"] = most - before;
  state.counters["budget_mib"] = static_cast<double>(options.cache_bytes) / (1 << 20);
}
BENCHMARK(query_map_larger_than_cache)->Unit(benchmark::kMillisecond)->Iterations(2000);

}  // namespace
}  // namespace gdfmap
