#include <memory>
#include <optional>
#include <span>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/error_map.hpp>
#include <gdfmap/pipeline/error_plot.hpp>
#include <gdfmap/pipeline/evaluate.hpp>
#include <gdfmap/pipeline/field_access.hpp>

#include "commands.hpp"
#include "evaluation_report.hpp"
#include "options.hpp"
#include "session.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "evaluate", "Compare the field with exact distances",
    "Without a cloud, a map is compared with its own points. Samples are spread evenly over levels "
    "and bands of distance within 30 m and weighted by the space that they stand for. Errors are "
    "those of answers that rest on cubes; far bounds and unknown answers are counted beside them. "
    "--truth compares with an analytic scene (see gdfmap synth); samples where the points "
    "themselves miss the scene by more than 5 mm are set aside and counted.",
    "  gdfmap evaluate city.gdfmap\n"
    "  gdfmap evaluate model.bin city.ply --step 0.1 --blend gdf1\n"
    "  gdfmap evaluate scene.gdfmap --truth city --samples 200000 --json\n"
    "  gdfmap evaluate city.gdfmap --map errors.ply --plot errors.png"};

struct Options {
  CommonOptions common;
  std::string path;
  std::string cloud;
  EvaluateOptions evaluate;
  BlendOption blend;
  std::string map_file;
  std::string plot_file;
};

/// The pictures of an evaluation that were asked for, fed with its samples.
class Pictures {
 public:
  explicit Pictures(const Options& options) : plot_file_(options.plot_file) {
    if (options.map_file.empty()) return;
    const double cube_size = open_tile_source(options.path)->geometry().cube_size;
    map_.emplace(options.map_file, cube_size);
  }

  [[nodiscard]] bool are_wanted() const { return map_ || !plot_file_.empty(); }
  void add(std::span<const JudgedSample> samples) {
    if (map_) map_->add(samples);
    if (!plot_file_.empty()) plot_.add(samples);
  }
  void write() {
    if (map_) map_->finish();
    if (!plot_file_.empty()) plot_.write(plot_file_);
  }

 private:
  std::optional<ErrorMapWriter> map_;
  ErrorPlot plot_;
  std::string plot_file_;
};

void run(const Options& options) {
  Session session(options.common, OnSignal::kStop);
  EvaluateOptions how = options.evaluate;
  how.cloud = options.cloud;
  how.blend = options.blend.mode();
  Pictures pictures(options);
  if (pictures.are_wanted()) {
    how.visit = [&](std::span<const JudgedSample> samples) { pictures.add(samples); };
  }
  const Evaluation evaluation = evaluate(options.path, how, session.context());
  pictures.write();
  if (session.json()) {
    session.print_json(evaluation_json(evaluation));
  } else {
    session.print(evaluation_text(evaluation));
  }
}

void add_sampling_options(CLI::App& app, EvaluateOptions& how) {
  CLI::Option* const samples =
      app.add_option("--samples", how.num_samples,
                     "Number of random samples (default " + std::to_string(how.num_samples) + ")")
          ->option_text("N")
          ->check(CLI::PositiveNumber, "");
  CLI::Option* const seed =
      app.add_option("--seed", how.seed,
                     "Which random samples (default " + std::to_string(how.seed) + ")")
          ->option_text("S");
  add_number(app, "--step", how.step, "M", {1e-3, 1e4},
             "Instead of random samples, those of G-EDF's evaluator: a regular grid in every fine "
             "cube, this many metres apart")
      ->excludes(samples)
      ->excludes(seed);
}

}  // namespace

Command add_evaluate(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP|MODEL", options->path, "A map, or a GDF1 (.bin) or CSV (.csv) model")
      ->required();
  CLI::Option* const cloud = app->add_option(
      "CLOUD", options->cloud, "Cloud to compare with; default: the points of the map");
  CLI::Option* const truth =
      app->add_option("--truth", options->evaluate.truth_scene,
                      "Compare with this analytic scene (see gdfmap synth --list)")
          ->option_text("SCENE")
          ->excludes(cloud);
  add_number(*app, "--size", options->evaluate.truth_size, "M", {0.0, 1e6},
             "Size of that scene in metres; 0 is its own")
      ->needs(truth);
  add_sampling_options(*app, options->evaluate);
  add_blend_option(*app, options->blend);
  app->add_option("--map", options->map_file,
                  "Write the samples as a .ply file, coloured by error, with error, distance, "
                  "level and status as properties")
      ->option_text("FILE");
  app->add_option("--plot", options->plot_file,
                  "Draw the distribution of the errors, and error against distance, as a .png file")
      ->option_text("FILE");
  add_common_options(*app, options->common, kThreads | kMemory | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
