#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/verify.hpp>

#include "commands.hpp"
#include "options.hpp"
#include "session.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "verify", "Check that a map is sound",
    "Checks both databases, that they belong together, and every checksum of points and cubes. "
    "Prints one line for each fault and then ends with exit code 4. Changes nothing; it may run "
    "beside a writer.",
    "  gdfmap verify city.gdfmap\n"
    "  gdfmap verify city.gdfmap --quick"};

struct Options {
  CommonOptions common;
  std::string map;
  bool quick = false;
};

std::string report_text(const VerifyReport& report) {
  std::string text;
  for (const std::string& fault : report.faults) text += "fault: " + fault + "\n";
  if (report.faults.empty()) text += "sound\n";
  return text + "content_digest " + report.content_digest.hex() + "\n";
}

nlohmann::ordered_json report_json(const VerifyReport& report, bool quick) {
  return {{"sound", report.faults.empty()},
          {"quick", quick},
          {"faults", report.faults},
          {"content_digest", report.content_digest.hex()}};
}

void run(const Options& options) {
  Session session(options.common, OnSignal::kEnd);
  Map map = Map::open(options.map, Access::kRead, session.context());
  const VerifyReport report = verify(map, options.quick);
  if (session.json()) {
    session.print_json(report_json(report, options.quick));
  } else {
    session.print(report_text(report));
  }
  if (!report.faults.empty()) {
    throw Error(ErrorCode::kCorrupt, options.map + " has " + grouped(report.faults.size()) +
                                         (report.faults.size() == 1 ? " fault" : " faults"));
  }
}

}  // namespace

Command add_verify(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP", options->map, "Directory of the map, NAME.gdfmap")->required();
  app->add_flag("--quick", options->quick, "Leave out the checksums of points and cubes");
  add_common_options(*app, options->common, kMemory | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
