#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/map/map.hpp>

#include "commands.hpp"
#include "options.hpp"
#include "session.hpp"
#include "tile_report.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "tile", "List the tiles of a map, or look into one",
    "A tile is 8 x 8 x 8 cubes, the unit of disk and cache. Without --at or --key every trained "
    "tile is listed; with one of them the cubes of that tile are: status (fitted, poor, failed), "
    "class, errors in metres, sizes.",
    "  gdfmap tile city.gdfmap --list\n"
    "  gdfmap tile city.gdfmap --at 12,3.5,1.2\n"
    "  gdfmap tile city.gdfmap --key 0,1,0,-1 --json"};

struct Options {
  CommonOptions common;
  std::string map;
  std::string at;
  std::string key;
  bool list = false;
};

TileKey tile_at(const std::string& text, const Map& map) {
  const Vector3 p_world = parse_point(text, "--at");
  const std::optional<CubeKey> cube = map.lattice().cube_containing(p_world, 0);
  if (!cube) throw Error(ErrorCode::kUsage, "--at: '" + text + "' is too far away for this map");
  return tile_of(*cube);
}

TileView look_into(Map& map, const TileKey& key) {
  TileView view;
  view.key = key;
  view.box = map.lattice().tile_box(key);
  if (map.has_points() && key.level == 0) view.points = map.points().find_tile(key);
  view.state = map.cubes().find_state(key);
  if (view.state) view.record = map.cubes().read(key);
  return view;
}

/// Row by row, so that a map of any size can be listed.
void list_tiles(Map& map, Session& session) {
  if (!session.json()) {
    session.print(tile_row_heading());
    map.cubes().for_each_state([&](const TileState& s) { session.print(tile_row(s)); });
    return;
  }
  const char* separator = "{\"tiles\": [\n";
  map.cubes().for_each_state([&](const TileState& state) {
    session.print(separator + tile_state_json(state).dump());
    separator = ",\n";
  });
  session.print(*separator == ',' ? "\n]}\n" : "{\"tiles\": []}\n");
}

void run(const Options& options) {
  Session session(options.common, OnSignal::kEnd);
  Map map = Map::open(options.map, Access::kRead, session.context());
  if (options.at.empty() && options.key.empty()) {
    list_tiles(map, session);
    return;
  }
  const TileKey key =
      options.at.empty() ? parse_tile_key(options.key, "--key") : tile_at(options.at, map);
  const TileView view = look_into(map, key);
  if (session.json()) {
    session.print_json(tile_json(view));
  } else {
    session.print(tile_text(view));
  }
}

}  // namespace

Command add_tile(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP", options->map, "Directory of the map, NAME.gdfmap")->required();
  CLI::Option* const at =
      app->add_option("--at", options->at, "The tile of level 0 that holds this point, in metres")
          ->option_text("X,Y,Z");
  CLI::Option* const key =
      app->add_option("--key", options->key, "The tile with this key, as --list prints it")
          ->option_text("LEVEL,X,Y,Z")
          ->excludes(at);
  app->add_flag("--list", options->list, "List every trained tile (the default)")
      ->excludes(at)
      ->excludes(key);
  add_common_options(*app, options->common, kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
