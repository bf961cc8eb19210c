#include "tile_row.hpp"

#include <algorithm>
#include <cmath>

#include <gdfmap/core/error.hpp>
#include <gdfmap/store/tile_codec.hpp>

namespace gdfmap {
namespace {

std::int32_t checked(std::int64_t value, std::int64_t low, std::int64_t high,
                     const std::string& database_name) {
  if (value < low || value > high) {
    throw Error(ErrorCode::kCorrupt, database_name + ": a row of tiles holds " +
                                         std::to_string(value) + " where at most " +
                                         std::to_string(high) + " is possible");
  }
  return static_cast<std::int32_t>(value);
}

}  // namespace

std::int32_t read_coordinate(const db::Statement& row, int column,
                             const std::string& database_name) {
  return checked(row.integer(column), -kMaxTileCoordinate, kMaxTileCoordinate, database_name);
}

TileState read_state(const db::Statement& row, const std::string& database_name) {
  const auto coordinate = [&](int column) { return read_coordinate(row, column, database_name); };
  const auto count = [&](int column) {
    return checked(row.integer(column), 0, kCubesPerTile, database_name);
  };
  TileState state;
  const std::int32_t level = checked(row.integer(0), 0, kMaxLevels - 1, database_name);
  state.key = {level, coordinate(1), coordinate(2), coordinate(3)};
  state.surroundings = row.digest(4);
  state.configuration = row.digest(5);
  state.content = row.digest(6);
  state.num_cubes = count(7);
  state.num_populated = count(8);
  state.num_poor = count(9);
  state.num_failed = count(10);
  state.num_gaussians = row.integer(11);
  state.num_measured = count(12);
  state.mean_mae = row.real(13);
  state.max_mae = row.real(14);
  state.num_bytes = row.integer(15);
  return state;
}

TileState summarize(const TileRecord& tile, std::size_t num_bytes) {
  TileState state;
  state.key = tile.key;
  state.surroundings = tile.surroundings;
  state.configuration = tile.configuration;
  state.content = content_digest(tile);
  state.num_cubes = static_cast<int>(tile.cubes.size());
  state.num_bytes = static_cast<std::int64_t>(num_bytes);
  double sum = 0.0;
  for (const CubeRecord& cube : tile.cubes) {
    state.num_populated += cube.cube_class == CubeClass::kPopulated;
    state.num_poor += cube.status == CubeStatus::kPoor;
    state.num_failed += cube.status == CubeStatus::kFailed;
    state.num_gaussians += static_cast<std::int64_t>(cube.gaussians.size());
    if (cube.status == CubeStatus::kFailed || !std::isfinite(cube.errors.mae)) continue;
    ++state.num_measured;
    sum += cube.errors.mae;
    state.max_mae = std::max(state.max_mae, double{cube.errors.mae});
  }
  if (state.num_measured > 0) state.mean_mae = sum / state.num_measured;
  return state;
}

std::string tile_name(const TileKey& key) {
  return "tile " + std::to_string(key.level) + "," + std::to_string(key.x) + "," +
         std::to_string(key.y) + "," + std::to_string(key.z);
}

}  // namespace gdfmap
