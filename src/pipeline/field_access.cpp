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

}  // namespace gdfmap
