#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include <gdfmap/core/error.hpp>
#include <gdfmap/db/database.hpp>
#include <gdfmap/query/tile_source.hpp>

namespace gdfmap {
namespace {

constexpr std::size_t kPageCacheBytes = std::size_t{1} << 20;

CubeRecord to_record(const Gdf1Cube& cube) {
  constexpr float kNotKnown = std::numeric_limits<float>::quiet_NaN();
  CubeRecord record;
  record.index = cube_index_in_tile(cube.key);
  record.cube_class = CubeClass::kUnknown;
  record.errors = {cube.mae, std::hypot(cube.mae, cube.standard_deviation), kNotKnown, kNotKnown};
  record.gaussians = cube.gaussians;
  return record;
}

std::string cube_name(const CubeKey& key) {
  return "cube " + std::to_string(key.level) + "," + std::to_string(key.x) + "," +
         std::to_string(key.y) + "," + std::to_string(key.z);
}

}  // namespace

std::optional<TileVersion> TileSource::version(const TileKey&) { return TileVersion{}; }

StoreTileSource::StoreTileSource(const std::filesystem::path& path, const Geometry& geometry)
    : TileSource(geometry), path_(path), mode_(db::reading_mode(path)) {
  const auto opens_now = connection();
}

Pool<CubeStore>::Lease StoreTileSource::connection() {
  return connections_.borrow(
      [this] { return std::make_unique<CubeStore>(path_, mode_, kPageCacheBytes); });
}

std::optional<TileRecord> StoreTileSource::load(const TileKey& key) {
  // The connection is free for others before the cubes are decoded.
  const std::optional<EncodedTile> tile = connection()->read_encoded(key);
  return tile ? std::optional(decode(*tile, path_.string())) : std::nullopt;
}

std::optional<TileVersion> StoreTileSource::version(const TileKey& key) {
  const std::optional<TileState> state = connection()->find_state(key);
  if (!state) return std::nullopt;
  return TileVersion{state->surroundings, state->configuration, state->content};
}

std::vector<OccupiedTile> StoreTileSource::occupied() { return connection()->occupied(); }

bool StoreTileSource::has_cubes() { return connection()->has_cubes(); }

MemoryTileSource::MemoryTileSource(const Geometry& geometry, std::vector<TileRecord> tiles,
                                   std::vector<OccupiedTile> occupied)
    : TileSource(geometry), occupied_(std::move(occupied)) {
  for (TileRecord& tile : tiles) {
    const TileKey key = tile.key;
    if (!tiles_.emplace(key, std::move(tile)).second) {
      throw Error(ErrorCode::kUsage,
                  "the tile of " + cube_name(cube_at(key, 0)) + " is there twice");
    }
  }
}

std::optional<TileRecord> MemoryTileSource::load(const TileKey& key) {
  const auto found = tiles_.find(key);
  if (found == tiles_.end()) return std::nullopt;
  return found->second;
}

std::vector<OccupiedTile> MemoryTileSource::occupied() { return occupied_; }

bool MemoryTileSource::has_cubes() {
  return std::ranges::any_of(tiles_, [](const auto& entry) { return !entry.second.cubes.empty(); });
}

std::vector<TileRecord> tiles_of_model(std::span<const Gdf1Cube> cubes) {
  std::map<TileKey, std::map<int, const Gdf1Cube*>> by_tile;
  for (const Gdf1Cube& cube : cubes) {
    if (cube.key.level != 0) {
      throw Error(ErrorCode::kUsage, cube_name(cube.key) + " of a model is not of level 0");
    }
    if (!by_tile[tile_of(cube.key)].emplace(cube_index_in_tile(cube.key), &cube).second) {
      throw Error(ErrorCode::kUsage, cube_name(cube.key) + " of a model is there twice");
    }
  }
  std::vector<TileRecord> tiles;
  tiles.reserve(by_tile.size());
  for (const auto& [key, tile_cubes] : by_tile) {
    TileRecord& tile = tiles.emplace_back();
    tile.key = key;
    for (const auto& [index, cube] : tile_cubes) tile.cubes.push_back(to_record(*cube));
  }
  return tiles;
}

std::vector<OccupiedTile> cubes_as_occupied(std::span<const TileRecord> tiles) {
  std::vector<OccupiedTile> occupied;
  for (const TileRecord& tile : tiles) {
    if (tile.key.level != 0) continue;
    occupied.push_back({tile.key, {}});
    for (const CubeRecord& cube : tile.cubes) occupied.back().cubes.set(cube.index);
  }
  return occupied;
}

std::shared_ptr<TileSource> model_tile_source(const Model& model) {
  std::vector<TileRecord> tiles = tiles_of_model(model.cubes);
  std::vector<OccupiedTile> occupied = cubes_as_occupied(tiles);
  const Geometry geometry{model.header.cube_size, model.header.margin, 1};
  return std::make_shared<MemoryTileSource>(geometry, std::move(tiles), std::move(occupied));
}

}  // namespace gdfmap
