#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/map/map.hpp>
#include <gdfmap/pipeline/sources.hpp>

#include "commands.hpp"
#include "ingest_report.hpp"
#include "options.hpp"
#include "session.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "remove", "Take a cloud out of a map, as if it had never been ingested",
    "The source is gone in one step: an interruption leaves all of it or none, and room on disk "
    "that is not given back at once is given back by the next command that writes. Train the map "
    "afterwards: it is then the map of the clouds that are left.",
    "  gdfmap remove city.gdfmap --source 3\n"
    "  gdfmap remove city.gdfmap --source scan1.ply"};

struct Options {
  CommonOptions common;
  std::string map;
  std::string source;
};

void run(const Options& options) {
  Session session(options.common, OnSignal::kStop);
  Map map = Map::open(options.map, Access::kWrite, session.context());
  const SourceRecord source = select_source(map.points(), options.source);
  map.points().remove(source.id, session.context());
  if (session.json()) {
    session.print_json({{"map", options.map}, {"removed", source_json(source)}});
  } else {
    session.print("removed\n" + source_text(source));
  }
}

}  // namespace

Command add_remove(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP", options->map, "Directory of the map, NAME.gdfmap")->required();
  app->add_option("--source", options->source,
                  "Id of the source, or its path as it was given (see gdfmap sources)")
      ->option_text("ID|PATH")
      ->required();
  add_common_options(*app, options->common, kMemory | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
