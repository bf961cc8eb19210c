#include "stored_tiles.hpp"

namespace gdfmap {

std::vector<TilePoints> occupied_tiles(PointStore& points) {
  std::vector<TilePoints> tiles;
  points.for_each_tile([&](const TilePoints& tile) { tiles.push_back(tile); });
  return tiles;
}

TileStates stored_states(CubeStore& cubes, int level) {
  TileStates states;
  cubes.for_each_state([&](const TileState& state) {
    if (state.key.level == level) states.emplace(state.key, state);
  });
  return states;
}

StaleTiles find_stale(std::span<const CandidateTile> plan, TileStates stored,
                      const Digest& configuration) {
  StaleTiles result;
  for (const CandidateTile& tile : plan) {
    const auto found = stored.find(tile.key);
    const bool is_up_to_date = found != stored.end() &&
                               found->second.surroundings == tile.surroundings &&
                               found->second.configuration == configuration;
    if (!is_up_to_date) result.stale.push_back(tile);
    if (found != stored.end()) stored.erase(found);
  }
  for (const auto& [key, state] : stored) result.obsolete.push_back(key);
  return result;
}

}  // namespace gdfmap
