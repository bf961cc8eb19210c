#include <memory>
#include <string>
#include <vector>

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
    "beside a writer, but keeps one from beginning. Damaged cubes are fitted again by the next "
    "`gdfmap train`; a source with damaged points has to be removed and ingested again.",
    "  gdfmap verify city.gdfmap\n"
    "  gdfmap verify city.gdfmap --quick"};

struct Options {
  CommonOptions common;
  std::string map;
  bool quick = false;
};

std::string digest_text(const VerifyReport& report) {
  return report.content_digest ? report.content_digest->hex() : "unknown";
}

std::vector<std::string> all_faults(const VerifyReport& report) {
  std::vector<std::string> faults = report.cube_faults;
  faults.insert(faults.end(), report.point_faults.begin(), report.point_faults.end());
  return faults;
}

std::string report_text(const VerifyReport& report) {
  std::string text;
  for (const std::string& fault : all_faults(report)) text += "fault: " + fault + "\n";
  if (report.sound()) text += "sound\n";
  return text + "content_digest " + digest_text(report) + "\n";
}

nlohmann::ordered_json report_json(const VerifyReport& report, bool quick) {
  nlohmann::ordered_json json = {
      {"sound", report.sound()}, {"quick", quick}, {"faults", all_faults(report)}};
  json["content_digest"] = report.content_digest ? nlohmann::ordered_json(digest_text(report))
                                                 : nlohmann::ordered_json(nullptr);
  return json;
}

/// What to do about the faults found.
std::string remedy(const VerifyReport& report) {
  std::string text;
  if (!report.cube_faults.empty()) {
    text += "; `gdfmap train` fits damaged cubes again, without cubes.db it makes all of them anew";
  }
  if (!report.point_faults.empty()) {
    text += "; a source with damaged points: `gdfmap remove` it and ingest it again";
  }
  return text;
}

void run(const Options& options) {
  Session session(options.common, OnSignal::kEnd);
  Map map = Map::open(options.map, Access::kRead, session.context());
  const VerifyReport report = verify(map, options.quick, session.context());
  if (session.json()) {
    session.print_json(report_json(report, options.quick));
  } else {
    session.print(report_text(report));
  }
  if (report.sound()) return;
  const std::size_t num_faults = all_faults(report).size();
  throw Error(ErrorCode::kCorrupt, options.map + " has " + grouped(num_faults) +
                                       (num_faults == 1 ? " fault" : " faults") + remedy(report));
}

}  // namespace

Command add_verify(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP", options->map, "Directory of the map, NAME.gdfmap")->required();
  app->add_flag("--quick", options->quick, "Leave out the checksums of points and cubes");
  add_common_options(*app, options->common, kMemory | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
