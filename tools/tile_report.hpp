#pragma once

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include <gdfmap/store/cube_store.hpp>
#include <gdfmap/tiling/point_store.hpp>

namespace gdfmap::cli {

/// Everything that a map holds of one tile.
struct TileView {
  TileKey key;
  Box3 box;                          ///< world frame, metres
  std::optional<TilePoints> points;  ///< empty: no points, or the map has no points.db
  std::optional<TileState> state;    ///< empty: nothing is trained there
  std::optional<TileRecord> record;  ///< with `state`
};

[[nodiscard]] std::string tile_text(const TileView& view);
[[nodiscard]] nlohmann::ordered_json tile_json(const TileView& view);

/// One line a tile, in columns wide enough for any map.
[[nodiscard]] std::string tile_row_heading();
[[nodiscard]] std::string tile_row(const TileState& state);
[[nodiscard]] nlohmann::ordered_json tile_state_json(const TileState& state);

}  // namespace gdfmap::cli
