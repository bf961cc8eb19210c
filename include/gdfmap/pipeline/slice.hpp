#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include <gdfmap/core/run_context.hpp>
#include <gdfmap/query/distance_field.hpp>

namespace gdfmap {

enum class Axis { kX = 0, kY = 1, kZ = 2 };

struct SliceOptions {
  Axis axis = Axis::kZ;            ///< normal of the plane
  std::vector<double> at = {0.0};  ///< where planes cut the axis, metres
  double resolution = 0.05;        ///< metres between samples
  std::optional<Box3> region;      ///< world frame; empty: all cubes
  bool arrows = false;             ///< draw gradients, in pictures alone
};

/// Samples the field on planes through `source` and writes each as a picture (.png) or an array
/// (.npy, float32, rows upwards, NaN unknown). A single plane is written to `path`; of several, the
/// one at 1.5 on the z axis goes to STEM_z1.5.EXTENSION, and pictures share one colour scale. Needs
/// 5 bytes of memory per sample, 13 with arrows, and those of one picture. Returns the files
/// written.
/// @throws Error kUsage for another extension, arrows in an array, a plane that misses the map or
///         comes twice, or too many samples.
std::vector<std::filesystem::path> write_slices(const std::shared_ptr<TileSource>& source,
                                                const SliceOptions& options,
                                                const std::filesystem::path& path,
                                                const RunContext& context = {});

}  // namespace gdfmap
