#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/map/map.hpp>
#include <gdfmap/pipeline/configuration.hpp>
#include <gdfmap/train/train.hpp>

#include "commands.hpp"
#include "options.hpp"
#include "session.hpp"
#include "text.hpp"
#include "train_report.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "train", "Fit the cubes of a map whose points changed; run again to continue",
    "Fits cubes of space to exact distances from the map's points, and nothing that is up to date. "
    "Interrupted at any moment, run it again: the result is the same. The first run stores the "
    "configuration of the fit, later ones use it.",
    "  gdfmap train city.gdfmap\n"
    "  gdfmap train city.gdfmap --preset best\n"
    "  gdfmap train city.gdfmap --config fine.yaml --retrain"};

struct Options {
  CommonOptions common;
  std::string map;
  std::string config;
  std::string preset;
  bool retrain = false;
};

/// Reads the configuration file into the options of the run, and its threads unless some are given.
TrainOptions train_options(const Options& options, const Map& map, Session& session,
                           RunContext& context) {
  TrainOptions result;
  result.retrain = options.retrain;
  if (options.config.empty() && options.preset.empty()) return result;
  Configuration configuration;
  if (!options.config.empty()) configuration = load_configuration(options.config);
  if (!options.preset.empty()) configuration.preset = find_preset(options.preset);
  for (const std::string& notice : configuration.notices) session.context().warn(notice);
  check_geometry(map, configuration.geometry());
  result.config = configuration.fit_config(map.geometry().cube_size);
  if (context.num_threads == 0) context.num_threads = configuration.num_threads;
  return result;
}

void run(const Options& options) {
  Session session(options.common, OnSignal::kStop);
  RunContext context = session.context();
  Map map = Map::open(options.map, Access::kWrite, context);
  const TrainOptions how = train_options(options, map, session, context);
  const TrainReport report = train(map, how, context);
  const double seconds = session.seconds();
  if (session.json()) {
    session.print_json(train_json(report, seconds));
  } else {
    session.print(train_text(report, seconds));
  }
  throw_if_cubes_failed(map);
}

}  // namespace

Command add_train(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP", options->map, "Directory of the map, NAME.gdfmap")->required();
  app->add_option("--config", options->config,
                  "YAML file with the configuration of the fit (keys of config/default.yaml); it "
                  "must be the stored one unless --retrain is given")
      ->option_text("FILE");
  app->add_option(
         "--preset", options->preset,
         "What the keys that the configuration leaves out are: fast, balanced (default) or "
         "best; it must be the stored one unless --retrain is given")
      ->option_text("NAME")
      ->check(CLI::IsMember({"fast", "balanced", "best"}));
  app->add_flag("--retrain", options->retrain,
                "Store the configuration given, or the defaults, and fit the whole map with it");
  add_common_options(*app, options->common, kThreads | kMemory | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
