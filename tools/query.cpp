#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/query/path_queries.hpp>

#include "commands.hpp"
#include "field_source.hpp"
#include "options.hpp"
#include "output.hpp"
#include "path_report.hpp"
#include "sample_writer.hpp"
#include "session.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "query", "Distance, gradient, status and expected error at points; paths and rays",
    "Answers at points given one by one or as a cloud of any size. Columns: x, y, z, distance (m), "
    "gx, gy, gz (the gradient), status (fine, coarse, far: a lower bound, unknown) and "
    "expected_error (m). What is not known is nan in CSV and NPY, null in JSON; NPY holds float64 "
    "and the status as 0 fine, 1 coarse, 2 far, 3 unknown.\n"
    "--along looks for the narrowest place of a polyline: its distance, where it is, the bound "
    "that the distance keeps everywhere (lower_bound), how far a robot of --radius may go "
    "(free_length), whether that is all the way (is_free), and how much of the path is unknown. "
    "--ray follows a line to where the distance falls to --radius: end is hit, max_range or "
    "unknown; up to free_range nothing is that near. Both allow for twice the largest recorded "
    "error of the cubes.",
    "  gdfmap query city.gdfmap --at 12,3.5,1.2 --at 0,0,0\n"
    "  gdfmap query city.gdfmap --points path.csv --format npy > field.npy\n"
    "  gdfmap query city.gdfmap --along path.csv --radius 0.4\n"
    "  gdfmap query city.gdfmap --ray 0,0,1.5,1,0,0 --max-range 30\n"
    "  echo 12,3.5,1.2 | gdfmap query model.bin --points - --blend gdf1"};

constexpr std::size_t kPointsPerBatch = std::size_t{1} << 16;

struct Options {
  CommonOptions common;
  std::string path;
  std::vector<std::string> at;
  std::string points;
  std::string along;
  std::vector<std::string> rays;
  std::optional<double> radius;
  std::optional<double> max_range;
  std::optional<double> tolerance;
  std::string format = "csv";
  BlendOption blend;
};

/// Answers a batch and writes it.
void answer(const DistanceField& field, std::span<const Vector3> points_world,
            std::vector<FieldSample>& samples, SampleWriter& writer) {
  samples.resize(points_world.size());
  field.at(points_world, samples);
  writer.write(points_world, samples);
}

void answer_cloud(const DistanceField& field, const std::string& path, SampleWriter& writer) {
  const std::unique_ptr<PointReader> reader = open_point_cloud(path);
  std::vector<Vector3> points_world(kPointsPerBatch);
  std::vector<FieldSample> samples;
  while (const std::size_t count = reader->read(points_world)) {
    answer(field, std::span(points_world).first(count), samples, writer);
  }
}

std::vector<Vector3> read_path(const std::string& path) {
  const std::unique_ptr<PointReader> reader = open_point_cloud(path);
  std::vector<Vector3> corners_world, part(kPointsPerBatch);
  while (const std::size_t count = reader->read(part)) {
    corners_world.insert(corners_world.end(), part.begin(),
                         part.begin() + static_cast<std::ptrdiff_t>(count));
  }
  if (corners_world.empty()) {
    throw Error(ErrorCode::kUsage, path + " has no points: a path needs at least one");
  }
  return corners_world;
}

std::vector<Vector3> parse_points(const std::vector<std::string>& texts) {
  std::vector<Vector3> points;
  for (const std::string& text : texts) points.push_back(parse_point(text, "--at"));
  return points;
}

void check(const Options& options) {
  const int num_questions = (options.at.empty() ? 0 : 1) + (options.points.empty() ? 0 : 1) +
                            (options.along.empty() ? 0 : 1) + (options.rays.empty() ? 0 : 1);
  if (num_questions != 1) {
    throw Error(ErrorCode::kUsage, "one of --at, --points, --along and --ray must be given");
  }
  const bool walks = !options.along.empty() || !options.rays.empty();
  if ((options.radius || options.tolerance) && !walks) {
    throw Error(ErrorCode::kUsage, "--radius and --tolerance are for --along and --ray");
  }
  if (options.max_range && options.rays.empty()) {
    throw Error(ErrorCode::kUsage, "--max-range is for --ray");
  }
  if (walks && options.format == "npy") {
    throw Error(ErrorCode::kUsage, "--format npy is for --at and --points");
  }
}

void answer_points(const DistanceField& field, const Options& options,
                   std::span<const Vector3> points_world) {
  const std::unique_ptr<SampleWriter> writer = make_sample_writer(options.format);
  if (options.points.empty()) {
    std::vector<FieldSample> samples;
    answer(field, points_world, samples, *writer);
  } else {
    answer_cloud(field, options.points, *writer);
  }
  writer->finish();
}

void answer_path(const DistanceField& field, const Options& options) {
  PathOptions how;
  how.radius = options.radius.value_or(how.radius);
  how.tolerance = options.tolerance.value_or(how.tolerance);
  const std::vector<Vector3> path_world = read_path(options.along);
  write_output(clearance_text(clearance_along(field, path_world, how), options.format == "json"));
}

void answer_rays(const DistanceField& field, const Options& options, std::span<const Ray> rays) {
  RayOptions how;
  how.radius = options.radius.value_or(how.radius);
  how.max_range = options.max_range.value_or(how.max_range);
  how.tolerance = options.tolerance.value_or(how.tolerance);
  write_output(rays_text(rays, cast_rays(field, rays, how), options.format == "json"));
}

void run(const Options& options) {
  check(options);
  const std::vector<Vector3> points_world = parse_points(options.at);
  std::vector<Ray> rays;
  for (const std::string& text : options.rays) rays.push_back(parse_ray(text, "--ray"));
  const Session session(options.common, OnSignal::kEnd);
  DistanceFieldOptions how;
  how.cache_bytes = session.context().memory() / 2;
  how.blend = options.blend.mode();
  how.num_threads = session.context().num_threads;
  const DistanceField field(open_trained_source(options.path), how);

  if (!options.along.empty()) {
    answer_path(field, options);
  } else if (!rays.empty()) {
    answer_rays(field, options, rays);
  } else {
    answer_points(field, options, points_world);
  }
  throw_if_unreadable(field);
}

}  // namespace

Command add_query(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP|MODEL", options->path, "A map, or a GDF1 (.bin) or CSV (.csv) model")
      ->required();
  CLI::Option* const at =
      app->add_option("--at", options->at, "A point in metres, world frame; may be repeated")
          ->option_text("X,Y,Z")
          ->allow_extra_args(false);
  app->add_option("--points", options->points,
                  "A cloud of points in any format that ingest reads; - is standard input")
      ->option_text("FILE|-")
      ->excludes(at);
  app->add_option("--along", options->along,
                  "A polyline: its corners as a cloud in any format that ingest reads")
      ->option_text("FILE");
  app->add_option("--ray", options->rays,
                  "A ray in metres, world frame: origin and direction; may be repeated")
      ->option_text("X,Y,Z,DX,DY,DZ")
      ->allow_extra_args(false);
  add_number(*app, "--radius", options->radius, "M", {0.0, 1e6},
             "Of the robot (--along, default 0) or of the beam (--ray, default " +
                 exact(RayOptions{}.radius) + ")");
  add_number(*app, "--max-range", options->max_range, "M", {1e-3, 1e9},
             "Of a ray, default " + exact(RayOptions{}.max_range));
  add_number(*app, "--tolerance", options->tolerance, "M", {1e-6, 1e3},
             "Least step along paths and rays, default " + exact(PathOptions{}.tolerance));
  app->add_option("--format", options->format,
                  "csv, json (an array of objects) or npy; default " + options->format)
      ->option_text("FORMAT")
      ->check(CLI::IsMember({"csv", "json", "npy"}));
  add_blend_option(*app, options->blend);
  add_common_options(*app, options->common, kThreads | kMemory);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
