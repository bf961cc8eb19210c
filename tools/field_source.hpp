#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include <gdfmap/query/distance_field.hpp>

namespace gdfmap::cli {

/// The field of a map or a model file, for subcommands that are of no use without cubes.
/// @throws Error kUsage when a map has none yet; what open_tile_source throws.
[[nodiscard]] std::shared_ptr<TileSource> open_trained_source(const std::filesystem::path& path);

/// @throws Error kCorrupt when tiles could not be read: their answers are unknown.
void throw_if_unreadable(const DistanceField& field);

/// The same of what was counted. @param first_error  of the first of them
/// @param consequence  what that means for the result
void throw_if_unreadable(std::uint64_t num_tiles, const std::string& first_error,
                         const std::string& consequence);

}  // namespace gdfmap::cli
