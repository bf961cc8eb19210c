#include <gdfmap/core/lattice.hpp>
#include <gdfmap/pipeline/configuration.hpp>

#include "key_table.hpp"

namespace gdfmap {
namespace {

using Keys = KeyTable<Configuration>;

Keys::Read edt_mode() {
  return [](const YamlValue& value, Configuration&) -> std::string {
    const std::string mode = value.text().value_or("");
    if (mode == "pure") return {};
    return mode == "signed" ? "signed fields are not supported: set it to pure" : "must be pure";
  };
}

constexpr double kMostMetres = 1e6;
constexpr const char* kExactTargets =
    "distances are exact, taken from every point at the samples themselves, without a voxel grid";

const std::vector<Keys::Key>& keys() {
  using C = Configuration;
  using K = Keys;
  const auto none = [](const char* path, const char* reason) {
    return K::without_effect(path, reason);
  };
  static const std::vector<K::Key> table = {
      {"io.input_file", K::text(&C::input_file)},
      {"io.output_base", K::text(&C::output_base)},
      {"io.export_csv", K::flag(&C::export_csv)},
      {"io.export_bin", K::flag(&C::export_bin)},
      {"processing.num_threads", K::whole_number(&C::num_threads, 0, 4096)},
      {"processing.cube_size", K::number(&C::cube_size, 1e-3, 1e4)},
      {"processing.levels", K::whole_number(&C::num_levels, 1, kMaxLevels)},
      none("downsampling.step", "no coarse copy of the cloud is needed to skip far cubes"),
      none("trainer.sample_points", "samples lie on a regular lattice, 12 along each axis"),
      none("trainer.mae_threshold_good", "adaptive.mae_threshold alone ends the growth of a cube"),
      {"trainer.mae_threshold_max", K::number(&C::mae_threshold_max, 0.0, kMostMetres)},
      {"trainer.edt_mode", edt_mode()},
      {"solver.max_iterations", K::whole_number(&C::max_iterations, 1, 10'000)},
      none("solver.max_time_seconds", "a result must not depend on the speed of the machine"),
      {"adaptive.populated_steps", K::ladder(&C::populated_steps, kMaxGaussians)},
      {"adaptive.empty_steps", K::ladder(&C::empty_steps, kMaxGaussians)},
      {"adaptive.mae_threshold", K::number(&C::mae_threshold, 0.0, kMostMetres)},
      {"adaptive.empty_mae_threshold", K::number(&C::empty_mae_threshold, 0.0, kMostMetres)},
      {"adaptive.empty_distance_threshold",
       K::number(&C::empty_distance_threshold, 0.0, kMostMetres)},
      none("edt.voxel_size", kExactTargets),
      none("edt.margin_signed", "signed fields are not supported"),
      none("edt.margin_pure", "the margin is a quarter of cube_size"),
      none("edt.edt_extension", kExactTargets),
      none("edt.empty_search_margin", "empty cubes see every point, however far"),
      none("edt.empty_nearby_count", "empty cubes see every point, however many"),
      {"fit.preset", K::choice(&C::preset, find_preset, "fast, balanced or best")},
      {"fit.solver", K::choice(&C::solver, find_solver, "tensor or ceres")},
      {"fit.codec", K::choice(&C::codec, find_codec, "quantized or float32")},
  };
  return table;
}

}  // namespace

FitConfig Configuration::fit_config(double map_cube_size) const {
  FitConfig config = FitConfig::preset(preset.value_or(FitPreset::kBalanced), map_cube_size);
  if (populated_steps) config.populated_steps = *populated_steps;
  if (empty_steps) config.empty_steps = *empty_steps;
  if (mae_threshold) config.mae_threshold = config.empty_mae_threshold = *mae_threshold;
  if (empty_mae_threshold) config.empty_mae_threshold = *empty_mae_threshold;
  if (mae_threshold_max) config.mae_threshold_max = *mae_threshold_max;
  if (empty_distance_threshold) config.empty_distance_threshold = *empty_distance_threshold;
  if (max_iterations) config.max_iterations = *max_iterations;
  if (solver) config.solver = *solver;
  if (codec) config.codec = *codec;
  return config;
}

Configuration load_configuration(const std::filesystem::path& path) {
  Configuration configuration;
  read_yaml_file(path, Keys::bound(keys(), configuration));
  return configuration;
}

std::vector<std::string> configuration_keys() {
  std::vector<std::string> paths;
  for (const Keys::Key& key : keys()) paths.emplace_back(key.path);
  return paths;
}

}  // namespace gdfmap
