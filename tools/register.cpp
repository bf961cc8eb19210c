#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/align/registration.hpp>
#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/io/point_writer.hpp>
#include <gdfmap/pipeline/ingest.hpp>

#include "commands.hpp"
#include "options.hpp"
#include "register_report.hpp"
#include "session.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "register", "Find the pose of a scan in a map or in another cloud",
    "Prints T_target_source, which takes points of SCAN to the frame of the target, with how much "
    "of the scan lies on the target and which motions nothing determines. A map may be larger than "
    "memory: only tiles around the scan, laid on it by --init, are read. Where the pose cannot be "
    "trusted (too_few points, a degenerate scene such as a bare plane or a corridor, rejected for "
    "too few inliers) the report is printed, nothing is written, and the exit code is 6.\n"
    "Methods: auto (from coarse to fine), icp-point, icp-plane, gicp, gradicp, ndt, field (of a "
    "trained map).",
    "  gdfmap register city.gdfmap scan.pcd --init 120,40,1.5,0,0,90 --out T.txt\n"
    "  gdfmap register first.ply second.ply --method gicp --ply aligned.ply --json"};

constexpr std::size_t kPointsPerBatch = std::size_t{1} << 16;

struct Options {
  CommonOptions common;
  std::string target;
  std::string scan;
  std::string method = "auto";
  std::string init;
  std::string out;
  std::string ply;
  int stride = 1;
  RegistrationOptions registration;
};

/// Every stride-th point of a cloud, from the first one on.
std::vector<Vector3> read_points(const std::string& path, std::size_t stride,
                                 const RunContext& context) {
  const std::unique_ptr<PointReader> reader = open_point_cloud(path);
  std::vector<Vector3> points, batch(kPointsPerBatch);
  std::size_t index = 0;
  while (const std::size_t count = reader->read(batch)) {
    context.throw_if_stopped();
    for (const Vector3& p : std::span(batch).first(count)) {
      if (index++ % stride == 0) points.push_back(p);
    }
  }
  return points;
}

Eigen::Isometry3d first_guess(const std::string& text) {
  if (text.empty()) return Eigen::Isometry3d::Identity();
  if (std::filesystem::exists(text)) return read_transform(text);
  return parse_pose(text, "--init");
}

/// Tiles of a map are read through it as long as the window is used.
struct Target {
  std::optional<Map> map;
  std::optional<MapWindow> window;
};

bool is_map(const std::string& path) {
  return std::filesystem::is_directory(path) ||
         std::filesystem::path(path).extension() == ".gdfmap";
}

std::shared_ptr<const DistanceField> field_of(const Map& map, const RunContext& context) {
  DistanceFieldOptions options;
  options.cache_bytes = context.memory() / 4;
  options.num_threads = context.num_threads;
  return std::make_shared<const DistanceField>(map, options);
}

MapWindow window_of_map(Map& map, std::span<const Vector3> scan, const Eigen::Isometry3d& T_init,
                        bool with_field, const RunContext& context) {
  std::vector<Vector3> scan_world(scan.begin(), scan.end());
  for (Vector3& p : scan_world) p = T_init * p;
  MapWindow::MapOptions options;
  options.max_bytes = context.memory() / 2;
  if (with_field) options.field = field_of(map, context);
  MapWindow window(map, scan_world, options);
  if (window.num_tiles_left_out() > 0) {
    context.warn("the memory budget leaves out " +
                 grouped(std::uint64_t{window.num_tiles_left_out()}) + " of " +
                 grouped(std::uint64_t{window.num_tiles() + window.num_tiles_left_out()}) +
                 " tiles around the scan, the farthest from its centre");
  }
  return window;
}

Target open_target(const Options& options, std::span<const Vector3> scan,
                   const Eigen::Isometry3d& T_init, const RunContext& context) {
  Target target;
  if (is_map(options.target)) {
    target.map = Map::open(options.target, Access::kRead, context);
    target.window.emplace(
        window_of_map(*target.map, scan, T_init, options.method == "field", context));
  } else {
    target.window.emplace(read_points(options.target, 1, context));
  }
  return target;
}

void write_aligned(const std::string& path, std::vector<Vector3> points,
                   const Eigen::Isometry3d& T) {
  for (Vector3& p : points) p = T * p;
  const std::unique_ptr<PointWriter> writer = create_point_cloud(path);
  writer->write(points);
  writer->finish();
}

void write_results(const Options& options, std::vector<Vector3> scan,
                   const RegistrationResult& result) {
  if (!options.out.empty()) {
    AtomicFile file(options.out);
    file.write(transform_text(result.T_target_source));
    file.commit();
  }
  if (!options.ply.empty()) write_aligned(options.ply, std::move(scan), result.T_target_source);
}

void run(const Options& options) {
  Session session(options.common, OnSignal::kStop);
  const auto method = make_registration_method(options.method);
  const Eigen::Isometry3d T_init = first_guess(options.init);
  std::vector<Vector3> points =
      read_points(options.scan, static_cast<std::size_t>(options.stride), session.context());
  const Target target = open_target(options, points, T_init, session.context());
  RegistrationOptions how = options.registration;
  how.num_threads = session.context().num_threads;
  const RegistrationResult result = method->provide(*target.window, Scan(points), T_init, how);

  if (session.json()) {
    session.print_json(registration_json(options.method, result));
  } else {
    session.print(registration_text(options.method, result));
  }
  if (!is_usable(result.status)) {
    throw Error(ErrorCode::kCondition, std::string("no pose that can be trusted: ") +
                                           name_of(result.status) + ", " + result.reason);
  }
  write_results(options, std::move(points), result);
}

void add_result_options(CLI::App& app, Options& options) {
  app.add_option("--out", options.out, "Write T_target_source, 4 x 4 numbers row by row")
      ->option_text("T.txt");
  app.add_option("--ply", options.ply,
                 "Write the points of the scan in the target's frame: .ply, .pcd, .las, .xyz, .csv")
      ->option_text("FILE");
}

}  // namespace

Command add_register(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP|CLOUD", options->target, "The target: a map, or a cloud")->required();
  app->add_option("SCAN", options->scan, "A cloud in any format that ingest reads")->required();
  const auto names = registration_method_names();
  app->add_option("--method", options->method, "How, see above; default " + options->method)
      ->option_text("METHOD")
      ->check(CLI::IsMember(std::vector<std::string>(names.begin(), names.end())));
  app->add_option("--init", options->init,
                  "First guess of T_target_source: 4 x 4 numbers row by row in a file, or metres "
                  "and degrees, R = Rz(yaw) Ry(pitch) Rx(roll); default: the identity")
      ->option_text("T.txt|X,Y,Z,ROLL,PITCH,YAW");
  add_number(*app, "--voxel", options->registration.voxel, "M", {1e-3, 1e3},
             "Edge of the voxels that both clouds are thinned to; correspondences reach four of "
             "them, the cells of ndt are three and eight long");
  add_number(*app, "--stride", options->stride, "N", {1, 1e6}, "Take every N-th point of the scan");
  add_result_options(*app, *options);
  add_common_options(*app, options->common, kThreads | kMemory | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
