// A cloud into points.db: points a second, bytes a point, and what reading it alone takes.

#include <filesystem>
#include <string>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/io/point_writer.hpp>
#include <gdfmap/pipeline/synthetic_scene.hpp>
#include <gdfmap/tiling/ingest.hpp>

namespace gdfmap {
namespace {

constexpr std::size_t kNumPoints = 2'000'000;

/// A city of 60 m as a file, and a place for databases, deleted at the end.
class Workspace {
 public:
  explicit Workspace(const std::string& extension)
      : directory_(std::filesystem::temp_directory_path() /
                   ("gdfmap-benchmark-" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(directory_);
    cloud_ = directory_ / ("city" + extension);
    const SyntheticScene scene("city", 60.0);
    std::vector<Vector3> points;
    for (std::size_t i = 0; i < kNumPoints; ++i) points.push_back(scene.sample(i, 1, 0.0));
    const auto writer = create_point_cloud(cloud_);
    writer->write(points);
    writer->finish();
  }
  ~Workspace() {
    std::error_code ignored;
    std::filesystem::remove_all(directory_, ignored);
  }
  Workspace(const Workspace&) = delete;
  Workspace& operator=(const Workspace&) = delete;

  [[nodiscard]] const std::filesystem::path& cloud() const { return cloud_; }
  [[nodiscard]] std::filesystem::path new_database() const {
    std::filesystem::remove(directory_ / "points.db");
    return directory_ / "points.db";
  }

 private:
  std::filesystem::path directory_, cloud_;
};

void ingest_cloud(benchmark::State& state, const std::string& extension, double voxel_size) {
  const Workspace workspace(extension);
  const Lattice lattice(1.0);
  IngestOptions options;
  options.voxel_size = voxel_size;
  const RunContext context{.num_threads = static_cast<int>(state.range(0)),
                           .memory_bytes = std::size_t{256} << 20};
  PointStore::Totals totals;
  for (auto _ : state) {
    PointStore store(workspace.new_database(), db::OpenMode::kCreate);
    const auto reader = open_point_cloud(workspace.cloud());
    auto report = ingest_points(*reader, workspace.cloud(), lattice, store, options, context);
    benchmark::DoNotOptimize(report);
    totals = store.totals();
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kNumPoints));
  state.counters["bytes_per_point"] =
      static_cast<double>(totals.block_bytes) / static_cast<double>(totals.num_points);
}
BENCHMARK_CAPTURE(ingest_cloud, ply, ".ply", 0.0)->Arg(1)->Arg(2)->UseRealTime();
BENCHMARK_CAPTURE(ingest_cloud, las, ".las", 0.0)->Arg(2)->UseRealTime();
BENCHMARK_CAPTURE(ingest_cloud, ply_voxel_5_cm, ".ply", 0.05)->Arg(2)->UseRealTime();

void read_cloud(benchmark::State& state, const std::string& extension) {
  const Workspace workspace(extension);
  std::vector<Vector3> points(std::size_t{1} << 14);
  for (auto _ : state) {
    const auto reader = open_point_cloud(workspace.cloud());
    while (reader->read(points) > 0) {
    }
    benchmark::DoNotOptimize(reader->identity());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kNumPoints));
}
BENCHMARK_CAPTURE(read_cloud, ply, ".ply")->UseRealTime();
BENCHMARK_CAPTURE(read_cloud, las, ".las")->UseRealTime();

}  // namespace
}  // namespace gdfmap
