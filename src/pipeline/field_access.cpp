#include <gdfmap/core/error.hpp>
#include <gdfmap/gdf1/model.hpp>
#include <gdfmap/map/map.hpp>
#include <gdfmap/pipeline/field_access.hpp>

namespace gdfmap {

std::shared_ptr<TileSource> open_tile_source(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) {
    const Map map = Map::open(path, Access::kRead);
    return std::make_shared<StoreTileSource>(map.cubes_path(), map.geometry());
  }
  if (!std::filesystem::exists(path)) {
    throw Error(ErrorCode::kIo, path.string() + ": no such file or directory");
  }
  return model_tile_source(read_model(path));
}

Box3 occupied_bounds(std::span<const OccupiedTile> tiles, const Lattice& lattice) {
  Box3 box;
  for (const OccupiedTile& tile : tiles) {
    for (int i = 0; i < kCubesPerTile; ++i) {
      if (tile.cubes.test(i)) box.extend(lattice.cube_box(cube_at(tile.key, i)));
    }
  }
  return box;
}

}  // namespace gdfmap
