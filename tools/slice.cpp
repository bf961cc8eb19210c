#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include <gdfmap/pipeline/slice.hpp>

#include "commands.hpp"
#include "field_source.hpp"
#include "options.hpp"
#include "session.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "slice", "Draw the field on planes as pictures or arrays",
    "Samples the distance on planes across the map. A .png has a colour map, iso-lines and a "
    "legend in metres, and hatches what is unknown; a .npy holds float32 rows upwards, nan where "
    "unknown.",
    "  gdfmap slice city.gdfmap --axis z --at 1.2 --out slice.png\n"
    "  gdfmap slice city.gdfmap --at 0.5 --at 1.5 --at 3 --arrows --out slice.png\n"
    "  gdfmap slice model.bin --axis x --at -3 --resolution 0.02 --out slice.npy"};

struct Options {
  CommonOptions common;
  std::string path;
  std::string axis = "z";
  SliceOptions slice;
  std::string region;
  std::string out;
};

void run(const Options& options) {
  const Session session(options.common, OnSignal::kStop);
  SliceOptions how = options.slice;
  how.axis = static_cast<Axis>(options.axis.front() - 'x');
  if (!options.region.empty()) how.region = parse_box(options.region, "--region");
  write_slices(open_trained_source(options.path), how, options.out, session.context());
}

}  // namespace

Command add_slice(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP|MODEL", options->path, "A map, or a GDF1 (.bin) or CSV (.csv) model")
      ->required();
  app->add_option("--axis", options->axis,
                  "Axis that the plane stands on: x, y or z; default " + options->axis)
      ->option_text("x|y|z")
      ->check(CLI::IsMember({"x", "y", "z"}));
  app->add_option(
         "--at", options->slice.at,
         "Where the plane cuts the axis, in metres; may be given several times, for planes "
         "that share one colour scale, written to FILE with _z1.5 and the like in its name")
      ->option_text("M")
      ->check(CLI::Range(-1e9, 1e9))
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->required();
  add_number(*app, "--resolution", options->slice.resolution, "M", {1e-4, 1e4},
             "Metres between samples");
  app->add_option("--region", options->region,
                  "Box in metres, world frame, to draw; default: all cubes")
      ->option_text("X0,Y0,Z0,X1,Y1,Z1");
  app->add_flag("--arrows", options->slice.arrows, "Draw arrows along the gradient (.png)");
  app->add_option("--out", options->out, "File to write, .png or .npy")
      ->option_text("FILE")
      ->required();
  add_common_options(*app, options->common, kThreads | kMemory | kProgress);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
