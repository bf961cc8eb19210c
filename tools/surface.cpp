#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/surface.hpp>
#include <gdfmap/pipeline/surface_configuration.hpp>

#include "commands.hpp"
#include "field_source.hpp"
#include "options.hpp"
#include "session.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "surface", "Write the surface of a map as points or as a mesh",
    "Samples the field on a regular lattice. --points, the default, writes the samples that are "
    "within --threshold of the surface, the errors that cubes state allowed for. --mesh writes "
    "triangles around those, moved onto the "
    "surface: a closed sheet with two sides, since the field does not tell inside from outside.",
    "  gdfmap surface city.gdfmap points.ply\n"
    "  gdfmap surface city.gdfmap points.ply --project --region 0,0,-5,100,100,50\n"
    "  gdfmap surface model.bin mesh.ply --mesh --threshold 0.1 --resolution 0.05\n"
    "  gdfmap surface -c reconstruction.yaml"};

struct Options {
  CommonOptions common;
  std::string path, out;
  SurfacePointsOptions points;  ///< the range of a mesh too
  std::optional<double> threshold, sigmas;
  std::string region;
  std::string config;
  bool is_points = false, mesh = false, shell = false;
};

/// Puts what the configuration file says in the place of options.
void read_configuration(Options& options, const RunContext& context) {
  const SurfaceConfiguration configuration = load_surface_configuration(options.config);
  for (const std::string& notice : configuration.notices) context.warn(notice);
  options.path = configuration.input;
  options.out = configuration.output;
  options.threshold = configuration.threshold;
  options.points.range = configuration.range();
  options.points.sigmas = 0.0;  // as the ancestor has it
}

SurfaceReport write_surface(const Options& options, const RunContext& context) {
  const auto source = open_trained_source(options.path);
  if (options.mesh) {
    SurfaceMeshOptions mesh{.range = options.points.range, .shell = options.shell};
    mesh.threshold = options.threshold.value_or(mesh.threshold);
    return write_surface_mesh(source, mesh, options.out, context);
  }
  SurfacePointsOptions points = options.points;
  points.threshold = options.threshold.value_or(points.threshold);
  return write_surface_points(source, points, options.out, context);
}

std::string report_text(const SurfaceReport& report, const Options& options, double seconds) {
  Table table(Table::Alignment::kLeft);
  table.add({"written", options.out});
  if (options.mesh) {
    table.add({"mesh", grouped(report.num_triangles) + " triangles, " +
                           grouped(report.num_vertices) + " vertices"});
  } else {
    table.add({"points", grouped(report.num_vertices)});
  }
  if (options.points.project) {
    table.add({"left out", grouped(report.num_left_out) + " samples that led to no surface"});
  }
  table.add({"cubes", grouped(report.num_cubes) + " sampled, " + grouped(report.num_cubes_poor) +
                          " passed over for their error"});
  table.add({"samples", grouped(report.num_samples) + " in " + duration_text(seconds)});
  return table.text();
}

nlohmann::ordered_json report_json(const SurfaceReport& report, const Options& options,
                                   double seconds) {
  nlohmann::ordered_json json = {{"path", options.out}};
  json[options.mesh ? "num_vertices" : "num_points"] = report.num_vertices;
  if (options.mesh) json["num_triangles"] = report.num_triangles;
  if (options.points.project) json["num_left_out"] = report.num_left_out;
  json["num_cubes"] = report.num_cubes;
  json["num_cubes_poor"] = report.num_cubes_poor;
  json["num_samples"] = report.num_samples;
  json["num_unreadable_tiles"] = report.num_unreadable_tiles;
  json["seconds"] = seconds;
  return json;
}

void run(Options options) {
  Session session(options.common, OnSignal::kStop);
  if (!options.config.empty()) {
    read_configuration(options, session.context());
  } else if (options.out.empty()) {
    throw Error(ErrorCode::kUsage, "a map and a file to write are needed, or --config");
  } else if (!options.region.empty()) {
    options.points.range.region = parse_box(options.region, "--region");
  }
  options.points.sigmas = options.sigmas.value_or(options.points.sigmas);
  const SurfaceReport report = write_surface(options, session.context());
  if (session.json()) {
    session.print_json(report_json(report, options, session.seconds()));
  } else {
    session.print(report_text(report, options, session.seconds()));
  }
  if (report.num_vertices == 0) session.context().warn("nothing is within the threshold");
  throw_if_unreadable(report.num_unreadable_tiles, report.first_error,
                      "the surface has gaps there");
}

/// What a configuration file says instead.
void add_range_options(CLI::App& app, Options& options, CLI::Option* config) {
  for (CLI::Option* const option :
       {app.add_option("MAP|MODEL", options.path, "A map, or a GDF1 (.bin) or CSV (.csv) model"),
        app.add_option("OUT", options.out, "File to write, .ply, or .obj for a mesh"),
        add_number(app, "--threshold", options.threshold, "M", {1e-4, 1e4},
                   "Distance from the surface within which samples are taken, at most the edge of "
                   "a cube; default 0.05, of a mesh 0.08"),
        add_number(app, "--resolution", options.points.range.resolution, "M", {1e-4, 1e4},
                   "Metres between samples, at most the edge of a cube"),
        add_number(app, "--max-mae", options.points.range.max_mae, "M", {0.0, 1e6},
                   "Cubes with a greater mean absolute error are passed over"),
        app.add_option("--region", options.region,
                       "Box in metres, world frame, its upper faces excluded; default: all cubes")
            ->option_text("X0,Y0,Z0,X1,Y1,Z1")}) {
    option->excludes(config);
  }
}

}  // namespace

Command add_surface(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  CLI::Option* const config =
      app->add_option("-c,--config", options->config,
                      "YAML file with files, distances and region (keys of config/surface.yaml), "
                      "such as that of G-EDF's gaussian_to_ply")
          ->option_text("FILE");
  add_range_options(*app, *options, config);
  CLI::Option* const points =
      app->add_flag("--points", options->is_points, "Write points, the default");
  CLI::Option* const project = app->add_flag(
      "--project", options->points.project,
      "Move each point onto the surface, with normal and expected error; leave out those that lead "
      "to none");
  CLI::Option* const mesh = app->add_flag("--mesh", options->mesh, "Write a triangle mesh");
  mesh->excludes(points)->excludes(project);
  app->add_flag("--shell", options->shell,
                "Leave the mesh at the threshold, on both sides of the surface")
      ->needs(mesh);
  add_number(*app, "--sigmas", options->sigmas, "N", {0.0, 1e3},
             "Standard deviations of the stated errors by which points must be nearer than the "
             "threshold, up to a third of it; 0 is the distance alone; default 1, with --config 0")
      ->excludes(mesh);
  add_common_options(*app, options->common, kThreads | kMemory | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
