#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include <gdfmap/core/run_context.hpp>
#include <gdfmap/query/distance_field.hpp>

namespace gdfmap {

enum class Axis { kX = 0, kY = 1, kZ = 2 };

struct SliceOptions {
  Axis axis = Axis::kZ;        ///< normal of the plane
  double at = 0.0;             ///< where it cuts the axis, metres
  double resolution = 0.05;    ///< metres between samples
  std::optional<Box3> region;  ///< world frame; empty: all cubes
};

/// Samples the field on a plane through `source` and writes it as a picture (.png) or an array
/// (.npy, float32, rows upwards, NaN unknown).
/// @throws Error kUsage for another extension, a plane that misses the map, or too many samples.
void write_slice(const std::shared_ptr<TileSource>& source, const SliceOptions& options,
                 const std::filesystem::path& path, const RunContext& context = {});

}  // namespace gdfmap
