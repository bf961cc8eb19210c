#include "field_source.hpp"

#include <string>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/field_access.hpp>

#include "text.hpp"

namespace gdfmap::cli {

std::shared_ptr<TileSource> open_trained_source(const std::filesystem::path& path) {
  std::shared_ptr<TileSource> source = open_tile_source(path);
  if (!source->has_cubes()) {
    throw Error(ErrorCode::kUsage, path.string() + " has no cubes yet: run `gdfmap train " +
                                       path.string() + "` first");
  }
  return source;
}

void throw_if_unreadable(const DistanceField& field) {
  const TileCacheStatistics statistics = field.statistics();
  throw_if_unreadable(statistics.unreadable, statistics.first_error, "answers there are unknown");
}

void throw_if_unreadable(std::uint64_t num_tiles, const std::string& first_error,
                         const std::string& consequence) {
  if (num_tiles == 0) return;
  throw Error(ErrorCode::kCorrupt,
              grouped(num_tiles) + " tiles could not be read, " + consequence + ": " + first_error);
}

}  // namespace gdfmap::cli
