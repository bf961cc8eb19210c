#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/pipeline/model_exchange.hpp>

#include "commands.hpp"
#include "options.hpp"
#include "session.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "import", "Make a map of the cubes of a GDF1 (.bin) or CSV (.csv) file",
    "The new map can be queried, sliced, evaluated and exported; having no points it can be "
    "neither ingested into nor trained. Gaussians whose standard deviation is under 1 mm are "
    "dropped and counted: they are zero almost everywhere and their gradients are not finite.",
    "  gdfmap import room.gdfmap room.bin"};

struct Options {
  CommonOptions common;
  std::string map;
  std::string model;
};

std::string report_text(const ImportReport& report) {
  Table table(Table::Alignment::kLeft);
  table.add({"cubes",
             grouped(report.num_cubes) + " with " + grouped(report.num_gaussians) + " Gaussians"});
  table.add({"dropped", grouped(report.dropped.num_dropped_gaussians) + " Gaussians, " +
                            grouped(report.dropped.num_dropped_cubes) + " cubes"});
  return table.text();
}

nlohmann::ordered_json report_json(const ImportReport& report) {
  return {{"num_cubes", report.num_cubes},
          {"num_gaussians", report.num_gaussians},
          {"num_dropped_gaussians", report.dropped.num_dropped_gaussians},
          {"num_dropped_cubes", report.dropped.num_dropped_cubes}};
}

void run(const Options& options) {
  Session session(options.common, OnSignal::kStop);
  const ImportReport report = import_model(options.model, options.map, session.context());
  if (session.json()) {
    session.print_json(report_json(report));
  } else {
    session.print(report_text(report));
  }
}

}  // namespace

Command add_import(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP", options->map, "Directory of the new map, NAME.gdfmap")->required();
  app->add_option("MODEL", options->model, "File to read, .bin or .csv")->required();
  add_common_options(*app, options->common, kMemory | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
