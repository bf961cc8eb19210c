#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/gdf1/model.hpp>
#include <gdfmap/map/map.hpp>

namespace gdfmap {

struct ExportReport {
  std::uint64_t num_cubes = 0;
  std::uint64_t num_gaussians = 0;
  std::uint64_t num_poor = 0;       ///< left out: worse than mae_threshold_max
  std::uint64_t num_failed = 0;     ///< left out: no Gaussians
  Vector3 shift = Vector3::Zero();  ///< subtracted from world coordinates, see export_shift()
};

/// Writes the level-0 cubes of a map as GDF1 (.bin) or CSV (.csv), in Morton order; of those whose
/// box meets `region` (world frame, metres) when one is given. The file appears complete or not at
/// all.
/// @throws Error kUsage for another extension, nothing to export, or an extent that float32 cannot
/// carry
///         (names --region); kInterrupted, kIo, kCorrupt.
ExportReport export_model(Map& map, const std::filesystem::path& path,
                          const std::optional<Box3>& region = std::nullopt,
                          const RunContext& context = {});

struct ImportReport {
  std::uint64_t num_cubes = 0;
  std::uint64_t num_gaussians = 0;
  ModelReadCounts dropped;
};

/// Makes a new map of the cubes of a GDF1 or CSV file. It can be queried and exported, not trained.
/// @throws Error kUsage when the map exists; what read_model throws.
ImportReport import_model(const std::filesystem::path& model, const std::filesystem::path& map,
                          const RunContext& context = {});

}  // namespace gdfmap
