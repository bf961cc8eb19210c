#include <algorithm>
#include <map>

#include <gdfmap/train/stale_tiles.hpp>

#include "cube_job.hpp"
#include "tile_plan.hpp"

namespace gdfmap {
namespace {

FitConfig configuration_of(Map& map) {
  const auto stored = map.cubes().meta(kFitConfigKey);
  return stored ? FitConfig::from_canonical(*stored)
                : FitConfig::defaults(map.geometry().cube_size);
}

}  // namespace

std::vector<TileKey> stale_tiles(Map& map) {
  std::vector<TilePoints> occupied;
  map.points().for_each_tile([&](const TilePoints& tile) { occupied.push_back(tile); });
  std::map<TileKey, TileState> stored;
  map.cubes().for_each_state([&](const TileState& state) {
    if (state.key.level == 0) stored.emplace(state.key, state);
  });

  const FitConfig config = configuration_of(map);
  const Digest configuration = configuration_digest(config);
  std::vector<TileKey> stale;
  const TilePlan plan(0, occupied, map.lattice(), config, {});
  for (const CandidateTile& tile : plan.tiles()) {
    const auto found = stored.find(tile.key);
    if (found == stored.end()) {
      stale.push_back(tile.key);
      continue;
    }
    if (!is_up_to_date(found->second, tile, configuration)) stale.push_back(tile.key);
    stored.erase(found);
  }
  for (const auto& [key, state] : stored) stale.push_back(key);  // no candidates any more
  std::sort(stale.begin(), stale.end());
  return stale;
}

}  // namespace gdfmap
