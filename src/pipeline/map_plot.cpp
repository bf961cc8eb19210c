#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include <gdfmap/pipeline/map_plot.hpp>
#include <gdfmap/train/stale_tiles.hpp>

namespace gdfmap {
namespace {

/// Columns by x and y.
class Columns {
 public:
  void add_points(const TilePoints& tile) { column(tile.key).num_points += tile.num_points; }
  void add_state(const TileKey& tile, TrainingState state) {
    TrainingState& worst = column(tile).state;
    worst = std::max(worst, state);
  }
  [[nodiscard]] std::vector<TileColumn> list() const {
    std::vector<TileColumn> columns;
    for (const auto& [place, column] : columns_) columns.push_back(column);
    return columns;
  }

 private:
  TileColumn& column(const TileKey& tile) {
    return columns_.try_emplace({tile.x, tile.y}, TileColumn{tile.x, tile.y}).first->second;
  }

  std::map<std::pair<std::int32_t, std::int32_t>, TileColumn> columns_;
};

bool knows_points(const Map& map) { return map.has_points() && !map.is_imported(); }

std::set<TileKey> stale_tiles_of(Map& map) {
  if (!knows_points(map)) return {};
  const std::vector<TileKey> tiles = stale_tiles(map);
  return {tiles.begin(), tiles.end()};
}

}  // namespace

MapFromAbove look_from_above(Map& map) {
  Columns columns;
  const std::set<TileKey> stale = stale_tiles_of(map);
  std::set<TileKey> stored;
  map.cubes().for_each_state([&](const TileState& state) {
    if (state.key.level != 0) return;
    stored.insert(state.key);
    if (stale.contains(state.key)) columns.add_state(state.key, TrainingState::kStale);
    if (state.num_cubes == 0) return;
    const bool is_poor = state.num_poor > 0 || state.num_failed > 0;
    columns.add_state(state.key, is_poor ? TrainingState::kPoor : TrainingState::kTrained);
  });
  if (knows_points(map)) {
    map.points().for_each_tile([&](const TilePoints& tile) {
      columns.add_points(tile);
      if (!stored.contains(tile.key)) columns.add_state(tile.key, TrainingState::kUntrained);
    });
  }
  return {map.lattice().cube_size() * kCubesPerTileAxis, columns.list()};
}

}  // namespace gdfmap
