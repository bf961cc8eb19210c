#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <gdfmap/map/map.hpp>

namespace gdfmap {

/// How far training has come; later ones hide earlier ones where tiles stand above each other.
enum class TrainingState : std::uint8_t {
  kTrained,
  kPoor,   ///< trained, with cubes that are poor or failed
  kStale,  ///< trained from other points or with another configuration: the next train() sees to it
  kUntrained
};

/// The level-0 tiles of one column, seen from above.
struct TileColumn {
  std::int32_t x = 0, y = 0;     ///< of the tiles' keys
  std::uint64_t num_points = 0;  ///< stored in its tiles
  TrainingState state = TrainingState::kTrained;
};

/// A map from above: every column with points or cubes, once.
struct MapFromAbove {
  double tile_edge = 8.0;  ///< metres
  std::vector<TileColumn> columns;
};

/// Columns in the order of x, then y. Without points.db nothing is known of points, nor what is
/// stale. @throws what the stores throw.
[[nodiscard]] MapFromAbove look_from_above(Map& map);

/// Draws it as a PNG file, which appears complete or not at all: points per column by colour,
/// stripes for what is not well trained, a scale bar, axes in metres. Columns are merged where
/// there are more than 200 along the longer side. The bytes depend on the arguments and on the
/// installed version of cairo and its fonts alone.
/// @throws Error kUsage when there is no column; kIo.
void draw_from_above(const MapFromAbove& map, const std::filesystem::path& png);

}  // namespace gdfmap
