#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/pipeline/map_plot.hpp>

#include "commands.hpp"
#include "info_report.hpp"
#include "options.hpp"
#include "session.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "info", "What a map, a model file or a point cloud holds",
    "A map: geometry, sources, tiles, cubes, bytes, the digest of all cubes, and what training it "
    "takes. A GDF1 or CSV model: its header and counts. A point cloud: its format, the number of "
    "points that it declares and of those that are finite, and their bounds; the whole file is "
    "read.",
    "  gdfmap info city.gdfmap --plot above.png\n"
    "  gdfmap info city.bin --json\n"
    "  gdfmap info scan.las"};

constexpr std::size_t kPointsPerBatch = std::size_t{1} << 16;

struct Options {
  CommonOptions common;
  std::string path;
  std::string plot_file;
};

enum class Kind { kMap, kModel, kCloud };

/// By what stands in the file; by the extension where there is nothing to look at.
Kind kind_of(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path) || path.extension() == ".gdfmap") return Kind::kMap;
  if (path == "-") return Kind::kCloud;
  std::array<char, 6> start{};
  std::ifstream(path, std::ios::binary).read(start.data(), start.size());
  const std::string_view text(start.data(), start.size());
  if (text.starts_with("GDF1") || text == "CubeX,") return Kind::kModel;
  return path.extension() == ".bin" ? Kind::kModel : Kind::kCloud;
}

CloudView look_into_cloud(const std::string& path) {
  const std::unique_ptr<PointReader> reader = open_point_cloud(path);
  CloudView view;
  view.info = reader->info();
  std::vector<Vector3> points(kPointsPerBatch);
  while (const std::size_t count = reader->read(points)) {
    view.num_read += count;
    for (const Vector3& p : std::span(points).first(count)) {
      if (!p.allFinite()) continue;
      ++view.num_finite;
      view.bounds.extend(p);
    }
  }
  view.num_withheld = reader->num_withheld();
  return view;
}

ModelView look_into_model(const std::string& path) {
  ModelView view;
  view.format = model_format(path) == ModelFormat::kGdf1 ? "GDF1" : "CSV";
  view.summary = visit_model(path, [&](const Gdf1Cube& cube) {
    ++view.num_cubes;
    view.num_gaussians += cube.gaussians.size();
  });
  return view;
}

void print(Session& session, const auto& view) {
  if (session.json()) {
    session.print_json(info_json(view));
  } else {
    session.print(info_text(view));
  }
}

void run(const Options& options) {
  Session session(options.common, OnSignal::kEnd);
  const Kind kind = kind_of(options.path);
  if (kind != Kind::kMap && !options.plot_file.empty()) {
    throw Error(ErrorCode::kUsage, options.path + " is no map: --plot draws maps alone");
  }
  switch (kind) {
    case Kind::kMap: {
      Map map = Map::open(options.path, Access::kRead, session.context());
      if (!options.plot_file.empty()) draw_from_above(look_from_above(map), options.plot_file);
      print(session, look_into_map(map));
      break;
    }
    case Kind::kModel:
      print(session, look_into_model(options.path));
      break;
    case Kind::kCloud:
      print(session, look_into_cloud(options.path));
      break;
  }
}

}  // namespace

Command add_info(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP|MODEL|CLOUD", options->path,
                  "What to look into; - is a cloud on "
                  "standard input")
      ->required();
  app->add_option("--plot", options->plot_file,
                  "Draw the map from above as a .png file: points per tile, and what is trained, "
                  "stale or poor")
      ->option_text("FILE");
  add_common_options(*app, options->common, kMemory | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
