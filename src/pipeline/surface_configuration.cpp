#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/surface_configuration.hpp>

#include "key_table.hpp"

namespace gdfmap {
namespace {

using Keys = KeyTable<SurfaceConfiguration>;

/// What the ancestor does without: it takes each sample from its own cube alone.
Keys::Read blending() {
  return [](const YamlValue& value, SurfaceConfiguration& c) -> std::string {
    const auto enabled = value.flag();
    if (!enabled) return "must be true or false";
    if (!*enabled) {
      c.notices.emplace_back(
          "blending.enabled has no effect: neighbouring cubes are always blended, as their fits "
          "differ at the faces");
    }
    return {};
  };
}

constexpr double kMostMetres = 1e6;
constexpr double kFarthest = 1e9;

const std::vector<Keys::Key>& keys() {
  using C = SurfaceConfiguration;
  using K = Keys;
  const auto coordinate = [](double C::*member) {
    return K::number(member, -kFarthest, kFarthest);
  };
  static const std::vector<K::Key> table = {
      {"io.input_csv", K::text(&C::input)},
      {"io.output_ply", K::text(&C::output)},
      {"reconstruction.threshold", K::number(&C::threshold, 0.0, kMostMetres)},
      {"reconstruction.resolution", K::number(&C::resolution, 0.0, kMostMetres)},
      {"reconstruction.max_mae", K::number(&C::max_mae, 0.0, kMostMetres)},
      {"region.enabled", K::flag(&C::region_enabled)},
      {"region.x_min", coordinate(&C::x_min)},
      {"region.x_max", coordinate(&C::x_max)},
      {"region.y_min", coordinate(&C::y_min)},
      {"region.y_max", coordinate(&C::y_max)},
      {"region.z_min", coordinate(&C::z_min)},
      {"region.z_max", coordinate(&C::z_max)},
      {"blending.enabled", blending()},
      K::without_effect("blending.margin", "the margin is that of the map or model"),
  };
  return table;
}

void check(const SurfaceConfiguration& c, const std::filesystem::path& path) {
  if (c.input.empty() || c.output.empty()) {
    throw Error(ErrorCode::kUsage, path.string() + ": io.input_csv and io.output_ply must be set");
  }
  const bool has_room = c.x_min < c.x_max && c.y_min < c.y_max && c.z_min < c.z_max;
  if (c.region_enabled && !has_room) {
    throw Error(ErrorCode::kUsage,
                path.string() + ": region: each minimum must be less than its maximum");
  }
}

}  // namespace

SurfaceRange SurfaceConfiguration::range() const {
  SurfaceRange range{.resolution = resolution, .max_mae = max_mae, .region = {}};
  if (region_enabled)
    range.region = Box3(Vector3(x_min, y_min, z_min), Vector3(x_max, y_max, z_max));
  return range;
}

SurfaceConfiguration load_surface_configuration(const std::filesystem::path& path) {
  SurfaceConfiguration configuration;
  read_yaml_file(path, Keys::bound(keys(), configuration));
  check(configuration, path);
  return configuration;
}

std::vector<std::string> surface_configuration_keys() {
  std::vector<std::string> paths;
  for (const Keys::Key& key : keys()) paths.emplace_back(key.path);
  return paths;
}

}  // namespace gdfmap
