#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/map/map.hpp>

#include "commands.hpp"
#include "ingest_report.hpp"
#include "options.hpp"
#include "session.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "sources", "The clouds that a map was made from",
    "Lists every ingested cloud with its id, its path as it was given, the options of its ingest, "
    "and what became of its points. `gdfmap remove` and `gdfmap ingest --replace` take the id.",
    "  gdfmap sources city.gdfmap\n"
    "  gdfmap sources city.gdfmap --json"};

struct Options {
  CommonOptions common;
  std::string map;
};

void run(const Options& options) {
  Session session(options.common, OnSignal::kEnd);
  Map map = Map::open(options.map, Access::kRead, session.context());
  const std::vector<SourceRecord> sources = map.points().sources();
  if (session.json()) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const SourceRecord& source : sources) list.push_back(source_json(source));
    session.print_json({{"map", options.map}, {"sources", std::move(list)}});
    return;
  }
  if (sources.empty()) session.print("no sources\n");
  for (const SourceRecord& source : sources) session.print(source_text(source));
}

}  // namespace

Command add_sources(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP", options->map, "Directory of the map, NAME.gdfmap")->required();
  add_common_options(*app, options->common, kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
