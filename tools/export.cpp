#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/model_exchange.hpp>

#include "commands.hpp"
#include "export_report.hpp"
#include "options.hpp"
#include "session.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "export", "Write the cubes of a map as GDF1 (.bin) or CSV (.csv)",
    "Writes the format of robotics-upo/G-EDF and G-EDF-Loc. Cubes marked poor or failed are left "
    "out. The file holds float32 world coordinates: beyond 8192 m a shift is subtracted and "
    "written to OUT.json, and an extent over 65536 m is refused.",
    "  gdfmap export city.gdfmap city.bin\n"
    "  gdfmap export city.gdfmap block.csv --region 0,0,-5,100,100,50"};

struct Options {
  CommonOptions common;
  std::string map;
  std::string out;
  std::string region;
};

void run(const Options& options) {
  Session session(options.common, OnSignal::kStop);
  std::optional<Box3> region;
  if (!options.region.empty()) region = parse_box(options.region, "--region");
  Map map = Map::open(options.map, Access::kRead, session.context());
  if (!map.cubes().has_cubes()) {
    throw Error(ErrorCode::kUsage,
                options.map + " has no cubes yet: run `gdfmap train " + options.map + "` first");
  }
  const ExportReport report = export_model(map, options.out, region, session.context());
  if (session.json()) {
    nlohmann::ordered_json json = export_json(report);
    json["path"] = options.out;
    session.print_json(json);
  } else {
    session.print(export_text(report, options.out));
  }
}

}  // namespace

Command add_export(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP", options->map, "Directory of the map, NAME.gdfmap")->required();
  app->add_option("OUT", options->out, "File to write, .bin or .csv")->required();
  app->add_option("--region", options->region,
                  "Export only cubes that meet this box, in metres, world frame")
      ->option_text("X0,Y0,Z0,X1,Y1,Z1");
  add_common_options(*app, options->common, kMemory | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
