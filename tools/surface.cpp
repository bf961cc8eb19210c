#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/surface.hpp>

#include "commands.hpp"
#include "field_source.hpp"
#include "options.hpp"
#include "session.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "surface", "Write the surface of a map as points",
    "Samples the field on a regular lattice and writes the samples that are within --threshold of "
    "the surface, with the distance that the field states there.",
    "  gdfmap surface city.gdfmap points.ply\n"
    "  gdfmap surface city.gdfmap points.ply --project --region 0,0,-5,100,100,50\n"
    "  gdfmap surface model.bin points.ply --threshold 0.1 --resolution 0.05"};

struct Options {
  CommonOptions common;
  std::string path;
  std::string out;
  SurfacePointsOptions points;
  std::string region;
};

std::string report_text(const SurfaceReport& report, const std::string& out, double seconds) {
  Table table(Table::Alignment::kLeft);
  table.add({"written", out});
  table.add({"points", grouped(report.num_vertices)});
  table.add({"cubes", grouped(report.num_cubes) + " sampled, " + grouped(report.num_cubes_poor) +
                          " passed over for their error"});
  table.add({"samples", grouped(report.num_samples) + " in " + duration_text(seconds)});
  return table.text();
}

nlohmann::ordered_json report_json(const SurfaceReport& report, const std::string& out,
                                   double seconds) {
  return {{"path", out},
          {"num_points", report.num_vertices},
          {"num_cubes", report.num_cubes},
          {"num_cubes_poor", report.num_cubes_poor},
          {"num_samples", report.num_samples},
          {"num_unreadable_tiles", report.num_unreadable_tiles},
          {"seconds", seconds}};
}

void run(const Options& options) {
  Session session(options.common, OnSignal::kStop);
  SurfacePointsOptions how = options.points;
  if (!options.region.empty()) how.range.region = parse_box(options.region, "--region");
  const SurfaceReport report =
      write_surface_points(open_trained_source(options.path), how, options.out, session.context());
  if (session.json()) {
    session.print_json(report_json(report, options.out, session.seconds()));
  } else {
    session.print(report_text(report, options.out, session.seconds()));
  }
  throw_if_unreadable(report.num_unreadable_tiles, report.first_error,
                      "the surface has gaps there");
}

}  // namespace

Command add_surface(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP|MODEL", options->path, "A map, or a GDF1 (.bin) or CSV (.csv) model")
      ->required();
  app->add_option("OUT", options->out, "File to write, .ply")->required();
  add_number(*app, "--threshold", options->points.threshold, "M", {1e-4, 1e4},
             "Samples where the distance is below this are written");
  add_number(*app, "--resolution", options->points.range.resolution, "M", {1e-4, 1e4},
             "Metres between samples");
  add_number(*app, "--max-mae", options->points.range.max_mae, "M", {0.0, 1e6},
             "Cubes with a greater mean absolute error are passed over");
  app->add_option("--region", options->region, "Box in metres, world frame; default: all cubes")
      ->option_text("X0,Y0,Z0,X1,Y1,Z1");
  app->add_flag("--project", options->points.project,
                "Move each point onto the surface, and write normal and expected error with it");
  add_common_options(*app, options->common, kThreads | kMemory | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
