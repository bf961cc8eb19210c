#pragma once

#include <vector>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/map/map.hpp>

namespace gdfmap {

/// The level-0 tiles, in key order, that train() would train or delete now with the configuration
/// that the map was trained with (the defaults before): those that their points or their
/// surroundings left behind, and those that were never trained. Damage is not looked for.
/// @throws Error kUsage for an imported map; what the stores throw.
[[nodiscard]] std::vector<TileKey> stale_tiles(Map& map);

}  // namespace gdfmap
