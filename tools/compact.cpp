#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/map/map.hpp>

#include "commands.hpp"
#include "options.hpp"
#include "session.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "compact", "Merge the point blocks of a map and give back room on disk",
    "An ingest with little memory leaves many small blocks. This merges those of each cloud in "
    "each tile; the points, every digest and the trained cubes stay as they are. Interrupted at "
    "any moment nothing is lost; run it again to continue.",
    "  gdfmap compact city.gdfmap"};

struct Options {
  CommonOptions common;
  std::string map;
};

std::string report_text(const CompactReport& report) {
  Table table(Table::Alignment::kLeft);
  table.add({"merged", grouped(report.num_merged) + " tiles of a source"});
  table.add({"blocks", grouped(report.num_blocks_before) + " before, " +
                           grouped(report.num_blocks_after) + " now"});
  table.add({"points.db", byte_text(report.file_bytes_before) + " before, " +
                              byte_text(report.file_bytes_after) + " now"});
  return table.text();
}

nlohmann::ordered_json report_json(const CompactReport& report) {
  return {{"num_merged", report.num_merged},
          {"num_blocks_before", report.num_blocks_before},
          {"num_blocks_after", report.num_blocks_after},
          {"file_bytes_before", report.file_bytes_before},
          {"file_bytes_after", report.file_bytes_after}};
}

void run(const Options& options) {
  Session session(options.common, OnSignal::kStop);
  Map map = Map::open(options.map, Access::kWrite, session.context());
  const CompactReport report = map.points().compact(session.context());
  if (session.json()) {
    nlohmann::ordered_json json = report_json(report);
    json["map"] = options.map;
    json["seconds"] = session.seconds();
    session.print_json(json);
  } else {
    session.print(report_text(report));
  }
}

}  // namespace

Command add_compact(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP", options->map, "Directory of the map, NAME.gdfmap")->required();
  add_common_options(*app, options->common, kMemory | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
