#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/build.hpp>

#include "commands.hpp"
#include "export_report.hpp"
#include "ingest_report.hpp"
#include "options.hpp"
#include "session.hpp"
#include "train_report.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "build", "The whole job of a configuration file: ingest, train, export",
    "Accepts the configuration of robotics-upo/G-EDF. Ingests io.input_file into the map "
    "OUTPUT_BASE.gdfmap, trains it and writes OUTPUT_BASE.bin and .csv. Run again, it continues or "
    "finds nothing to do. A key that has no effect here is named in a warning that says why.",
    "  gdfmap build -c config.yaml"};

struct Options {
  CommonOptions common;
  std::string config;
};

std::string report_text(const BuildReport& report, const Configuration& configuration,
                        double seconds) {
  std::string text = "map         " + report.map.string() + "\n" + ingest_text(report.ingest) +
                     train_text(report.train, seconds);
  if (report.bin) text += export_text(*report.bin, configuration.output_base + ".bin");
  if (report.csv) text += export_text(*report.csv, configuration.output_base + ".csv");
  return text;
}

nlohmann::ordered_json report_json(const BuildReport& report, double seconds) {
  nlohmann::ordered_json json = {{"map", report.map.string()},
                                 {"ingest", ingest_json(std::span(&report.ingest, 1))},
                                 {"train", train_json(report.train, seconds)}};
  if (report.bin) json["bin"] = export_json(*report.bin);
  if (report.csv) json["csv"] = export_json(*report.csv);
  return json;
}

void run(const Options& options) {
  Session session(options.common, OnSignal::kStop);
  const Configuration configuration = load_configuration(options.config);
  for (const std::string& notice : configuration.notices) session.context().warn(notice);
  const BuildReport report = build(configuration, session.context());
  const double seconds = session.seconds();
  if (session.json()) {
    session.print_json(report_json(report, seconds));
  } else {
    session.print(report_text(report, configuration, seconds));
  }
  Map map = Map::open(report.map, Access::kRead, session.context());
  throw_if_cubes_failed(map);
}

}  // namespace

Command add_build(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("-c,--config", options->config, "YAML file (keys as in config/default.yaml)")
      ->option_text("FILE")
      ->required();
  add_common_options(*app, options->common, kThreads | kMemory | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
