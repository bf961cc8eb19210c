#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include <gdfmap/core/run_context.hpp>
#include <gdfmap/map/map.hpp>
#include <gdfmap/tiling/ingest.hpp>

namespace gdfmap {

/// Streams a cloud ("-": standard input) into a map that is open for writing. The same cloud with
/// the same options again changes nothing and says so in the report. Memory is bounded, and an
/// ingest that fails or is interrupted leaves nothing visible.
/// @throws Error as open_point_cloud, ingest_points and Map::points do.
IngestReport ingest(const std::filesystem::path& cloud, Map& map, const IngestOptions& options = {},
                    const RunContext& context = {});

/// What somebody asks of a map's geometry; what is empty may be anything.
struct GeometryChoice {
  std::optional<double> cube_size;  ///< metres
  std::optional<int> num_levels;
};

/// @throws Error kUsage when the map's geometry, fixed when it was created, is not what is asked
/// for.
void check_geometry(const Map& map, const GeometryChoice& choice);

/// The map at `path`, opened for writing, or a new one with this geometry, as Geometry has it where
/// nothing is asked for.
/// @throws Error kUsage when there is a map of another geometry.
[[nodiscard]] Map open_or_create_map(const std::filesystem::path& path,
                                     const GeometryChoice& choice, const RunContext& context = {});

/// Reads a 4 × 4 row-major matrix of numbers (T_map_source, translation in metres).
/// @throws Error kIo, or kUsage unless it is a rigid transformation.
[[nodiscard]] Eigen::Isometry3d read_transform(const std::filesystem::path& path);

/// The options of clouds that are scans, each in the frame of its sensor: their poses
/// (io/poses.hpp), in the order of the clouds. A cloud is ingested with transform · pose, and the
/// sensor stood at the pose's place, unless the options say where else in its frame.
/// @throws Error kUsage unless there is one pose for every cloud; as read_poses() does.
[[nodiscard]] std::vector<IngestOptions> posed_options(const IngestOptions& options,
                                                       const std::filesystem::path& poses_path,
                                                       std::size_t num_clouds);

/// What training a map will take, from its occupied cubes; printed before anybody waits for it.
struct TrainingEstimate {
  std::uint64_t num_cubes = 0;
  std::uint64_t num_bytes = 0;  ///< of cubes.db
  double core_minutes = 0.0;    ///< on one core of the kind that BENCHMARK.md names
};
[[nodiscard]] TrainingEstimate estimate_training(Map& map);

}  // namespace gdfmap
