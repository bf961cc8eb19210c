#include <array>
#include <fstream>
#include <sstream>
#include <string>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/rigid_transform.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/io/poses.hpp>
#include <gdfmap/pipeline/ingest.hpp>

namespace gdfmap {
namespace {

/// Figures of BENCHMARK.md's maps, all levels: cubes fitted for each occupied one, bytes and
/// milliseconds for each of them.
constexpr double kCandidatesPerOccupiedCube = 4.3;
constexpr double kBytesPerCube = 80.0;
constexpr double kMillisecondsPerCube = 0.3;

std::array<double, 16> read_matrix(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw Error(ErrorCode::kIo, "cannot read " + path.string());
  std::array<double, 16> values{};
  for (double& value : values) {
    if (!(file >> value)) {
      throw Error(ErrorCode::kUsage, path.string() + ": 16 numbers are expected, row by row");
    }
  }
  return values;
}

}  // namespace

Eigen::Isometry3d read_transform(const std::filesystem::path& path) {
  const std::array<double, 16> values = read_matrix(path);
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(values.data());
  const auto transform = rigid_transform(matrix.topRows<3>());
  if (!transform || matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    throw Error(ErrorCode::kUsage,
                path.string() + ": not a rigid transformation; a factor goes into --scale");
  }
  return *transform;
}

std::vector<IngestOptions> posed_options(const IngestOptions& options,
                                         const std::filesystem::path& poses_path,
                                         std::size_t num_clouds) {
  const std::vector<Eigen::Isometry3d> poses = read_poses(poses_path);
  if (poses.size() != num_clouds) {
    throw Error(ErrorCode::kUsage,
                poses_path.string() + ": it holds " + std::to_string(poses.size()) + " poses for " +
                    std::to_string(num_clouds) +
                    " clouds; the first pose is that of the first cloud, and so on");
  }
  std::vector<IngestOptions> result(num_clouds, options);
  for (std::size_t i = 0; i < num_clouds; ++i) {
    result[i].transform.T_map_source = options.transform.T_map_source * poses[i];
    result[i].sensor_origin_source = options.sensor_origin_source.value_or(Vector3::Zero());
  }
  return result;
}

IngestReport ingest(const std::filesystem::path& cloud, Map& map, const IngestOptions& options,
                    const RunContext& context) {
  const std::unique_ptr<PointReader> reader = open_point_cloud(cloud);
  return ingest_points(*reader, cloud.string(), map.lattice(), map.points(), options, context);
}

void check_geometry(const Map& map, const GeometryChoice& choice) {
  const auto check = [&](const char* name, const auto& wanted, const auto& actual) {
    if (!wanted || *wanted == actual) return;
    std::ostringstream text;
    text << map.path().string() << " has " << name << ' ' << actual << ", not " << *wanted
         << ": that was fixed when it was created";
    throw Error(ErrorCode::kUsage, text.str());
  };
  check("cube_size", choice.cube_size, map.geometry().cube_size);
  check("levels", choice.num_levels, map.geometry().num_levels);
}

Map open_or_create_map(const std::filesystem::path& path, const GeometryChoice& choice,
                       const RunContext& context) {
  if (!Map::exists(path)) {
    const double size = choice.cube_size.value_or(Geometry{}.cube_size);
    const int levels = choice.num_levels.value_or(Geometry{}.num_levels);
    static_cast<void>(Map::create(path, {size, kMarginRatio * size, levels}));
  }
  Map map = Map::open(path, Access::kWrite, context);
  check_geometry(map, choice);
  return map;
}

TrainingEstimate estimate_training(Map& map) {
  std::uint64_t num_occupied = 0;
  map.points().for_each_tile([&](const TilePoints& tile) {
    num_occupied += static_cast<std::uint64_t>(tile.cubes.count());
  });
  const double num_cubes = kCandidatesPerOccupiedCube * static_cast<double>(num_occupied);
  return {static_cast<std::uint64_t>(num_cubes),
          static_cast<std::uint64_t>(num_cubes * kBytesPerCube),
          num_cubes * kMillisecondsPerCube / 60'000.0};
}

}  // namespace gdfmap
