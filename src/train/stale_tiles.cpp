#include <algorithm>
#include <utility>

#include <gdfmap/train/stale_tiles.hpp>

#include "cube_job.hpp"
#include "stored_tiles.hpp"

namespace gdfmap {
namespace {

FitConfig configuration_of(Map& map) {
  const auto stored = map.cubes().meta(kFitConfigKey);
  return stored ? FitConfig::from_canonical(*stored)
                : FitConfig::defaults(map.geometry().cube_size);
}

}  // namespace

std::vector<TileKey> stale_tiles(Map& map) {
  const std::vector<TilePoints> occupied = occupied_tiles(map.points());
  const FitConfig config = configuration_of(map);
  const TilePlan plan(0, occupied, map.lattice(), config, {});
  StaleTiles tiles =
      find_stale(plan.tiles(), stored_states(map.cubes(), 0), configuration_digest(config));
  std::vector<TileKey> keys = std::move(tiles.obsolete);
  for (const CandidateTile& tile : tiles.stale) keys.push_back(tile.key);
  std::sort(keys.begin(), keys.end());
  return keys;
}

}  // namespace gdfmap
