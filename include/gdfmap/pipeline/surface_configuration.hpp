#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <gdfmap/pipeline/surface.hpp>

namespace gdfmap {

/// The configuration file of a surface: the sections and keys of G-EDF's reconstruction.yaml.
/// Documented in config/surface.yaml and schema/surface.schema.json.
struct SurfaceConfiguration {
  std::string input;   ///< io.input_csv: a map, or a GDF1 or CSV model
  std::string output;  ///< io.output_ply
  double threshold = SurfacePointsOptions{}.threshold;  ///< metres
  double resolution = SurfaceRange{}.resolution;        ///< metres
  double max_mae = SurfaceRange{}.max_mae;              ///< metres
  bool region_enabled = false;
  double x_min = 0.0, x_max = 0.0;  ///< metres, world frame
  double y_min = 0.0, y_max = 0.0;
  double z_min = 0.0, z_max = 0.0;

  /// One line for each key that is accepted for compatibility but changes nothing, saying why.
  std::vector<std::string> notices;

  [[nodiscard]] SurfaceRange range() const;
};

/// Reads and validates a YAML file of at most 1 MiB.
/// @throws Error as load_configuration(); kUsage too for a region without room and where input or
///         output is missing
[[nodiscard]] SurfaceConfiguration load_surface_configuration(const std::filesystem::path& path);

/// Every key that load_surface_configuration accepts, "section.key", in file order.
[[nodiscard]] std::vector<std::string> surface_configuration_keys();

}  // namespace gdfmap
