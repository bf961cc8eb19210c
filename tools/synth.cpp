#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/parallel.hpp>
#include <gdfmap/io/point_writer.hpp>
#include <gdfmap/pipeline/synthetic_scene.hpp>

#include "commands.hpp"
#include "options.hpp"
#include "session.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "synth", "Write points of an analytic scene, of which the true distance is known",
    "Samples the surfaces of a scene uniformly by area, any number of points, and writes a cloud. "
    "The geometry depends on the scene's name and size alone, so that `gdfmap evaluate --truth` "
    "knows the exact field. The same arguments give the same file.",
    "  gdfmap synth --list\n"
    "  gdfmap synth city city.ply --points 2000000 --noise 0.01"};

constexpr std::size_t kPointsPerBatch = std::size_t{1} << 18;
constexpr std::size_t kPointsPerTask = std::size_t{1} << 12;

struct Options {
  CommonOptions common;
  bool list = false;
  std::string scene;
  std::string out;
  std::uint64_t num_points = 0;
  double size = 0.0;
  double noise = 0.0;
  std::uint64_t seed = 1;
};

void print_scenes(Session& session) {
  if (session.json()) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const SceneInfo& scene : scenes()) {
      list.push_back({{"name", scene.name},
                      {"description", scene.description},
                      {"default_size", scene.default_size}});
    }
    session.print_json(nlohmann::ordered_json{{"scenes", std::move(list)}});
    return;
  }
  Table table(Table::Alignment::kLeft);
  for (const SceneInfo& scene : scenes()) {
    table.add({scene.name, exact(scene.default_size) + " m", scene.description});
  }
  session.print(table.text());
}

/// Fills `points` with the scene's points from number `first` on.
void sample(const SyntheticScene& scene, const Options& options, std::uint64_t first,
            std::span<Vector3> points, int num_threads) {
  const std::size_t num_tasks = (points.size() + kPointsPerTask - 1) / kPointsPerTask;
  parallel_for(num_tasks, num_threads, [&](std::size_t task) {
    const std::size_t end = std::min(points.size(), (task + 1) * kPointsPerTask);
    for (std::size_t i = task * kPointsPerTask; i < end; ++i) {
      points[i] = scene.sample(first + i, options.seed, options.noise);
    }
  });
}

void write_scene(const Options& options, const RunContext& context) {
  const SyntheticScene scene(options.scene, options.size);
  const std::unique_ptr<PointWriter> writer = create_point_cloud(options.out);
  std::vector<Vector3> points(std::min<std::uint64_t>(options.num_points, kPointsPerBatch));
  for (std::uint64_t done = 0; done < options.num_points;) {
    context.throw_if_stopped();
    const std::size_t count = std::min<std::uint64_t>(options.num_points - done, points.size());
    sample(scene, options, done, std::span(points).first(count), context.threads());
    writer->write(std::span(points).first(count));
    done += count;
    context.progress({"points", done, options.num_points, {}});
  }
  writer->finish();
}

void run(const Options& options) {
  Session session(options.common, OnSignal::kStop);
  if (options.list) {
    print_scenes(session);
    return;
  }
  if (options.scene.empty() || options.out.empty() || options.num_points == 0) {
    throw Error(ErrorCode::kUsage, "SCENE, OUT and --points are required (or --list)");
  }
  write_scene(options, session.context());
  if (session.json()) {
    session.print_json(nlohmann::ordered_json{{"scene", options.scene},
                                              {"path", options.out},
                                              {"num_points", options.num_points},
                                              {"seconds", session.seconds()}});
  } else {
    session.print("written     " + options.out + ", " + grouped(options.num_points) + " points\n");
  }
}

}  // namespace

Command add_synth(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("SCENE", options->scene, "Name of the scene, see --list");
  app->add_option("OUT", options->out, "Cloud to write: .ply, .pcd, .las, .xyz, .csv or .txt");
  app->add_flag("--list", options->list, "List the scenes with their default size, and end");
  app->add_option("--points", options->num_points, "Number of points, at least 1")
      ->option_text("N")
      ->check(CLI::PositiveNumber, "");
  add_number(*app, "--size", options->size, "M", {0.0, 1e6},
             "Extent along x and y in metres; 0 is the scene's own");
  add_number(*app, "--noise", options->noise, "M", {0.0, 1e3},
             "Standard deviation of the displacement along the surface normal, in metres");
  app->add_option("--seed", options->seed,
                  "Which points of the surfaces (default " + std::to_string(options->seed) + ")")
      ->option_text("S");
  add_common_options(*app, options->common, kThreads | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
