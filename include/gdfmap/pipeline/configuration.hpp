#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <gdfmap/fit/fit_config.hpp>
#include <gdfmap/pipeline/ingest.hpp>

namespace gdfmap {

/// A configuration file: the sections and keys of G-EDF's config.yaml, and `fit`, which is ours.
/// Empty members were not given. Documented in config/default.yaml and schema/config.schema.json.
struct Configuration {
  std::string input_file;   ///< io.input_file
  std::string output_base;  ///< io.output_base
  bool export_csv = true;
  bool export_bin = true;
  int num_threads = 0;              ///< 0: one per core
  std::optional<double> cube_size;  ///< metres
  std::optional<int> num_levels;    ///< processing.levels

  std::optional<FitPreset> preset;
  std::optional<std::vector<int>> populated_steps;
  std::optional<std::vector<int>> empty_steps;
  std::optional<double> mae_threshold;        ///< metres; alone it is that of empty cubes too
  std::optional<double> empty_mae_threshold;  ///< metres
  std::optional<double> mae_threshold_max;
  std::optional<double> empty_distance_threshold;
  std::optional<int> max_iterations;
  std::optional<Solver> solver;
  std::optional<CubeCodec> codec;

  /// One line for each key that is accepted for compatibility but changes nothing, saying why.
  std::vector<std::string> notices;

  [[nodiscard]] GeometryChoice geometry() const { return {cube_size, num_levels}; }
  /// The preset for a cube size, with the other keys of the file put over it.
  [[nodiscard]] FitConfig fit_config(double map_cube_size) const;
};

/// Reads and validates a YAML file of at most 1 MiB.
/// @throws Error kIo when it cannot be read; kUsage for anything in it that is wrong: all
///         violations (the first twenty) at once, a line each, with key paths; an unknown key is
///         named together with the nearest known one.
[[nodiscard]] Configuration load_configuration(const std::filesystem::path& path);

/// Every key that load_configuration accepts, "section.key", in file order.
[[nodiscard]] std::vector<std::string> configuration_keys();

}  // namespace gdfmap
