#include "tile_report.hpp"

#include <array>
#include <cinttypes>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "text.hpp"

namespace gdfmap::cli {
namespace {

const char* name_of(CubeStatus status) {
  switch (status) {
    case CubeStatus::kFitted:
      return "fitted";
    case CubeStatus::kPoor:
      return "poor";
    case CubeStatus::kFailed:
      break;
  }
  return "failed";
}

const char* name_of(CubeClass cube_class) {
  switch (cube_class) {
    case CubeClass::kEmpty:
      return "empty";
    case CubeClass::kPopulated:
      return "populated";
    case CubeClass::kUnknown:
      break;
  }
  return "unknown";
}

const char* name_of(FailureReason reason) {
  return reason == FailureReason::kNotFinite ? "not_finite" : "none";
}

std::string key_text(const TileKey& key) {
  return std::to_string(key.level) + "," + std::to_string(key.x) + "," + std::to_string(key.y) +
         "," + std::to_string(key.z);
}

std::string hex(std::uint64_t value) {
  std::array<char, 17> text;
  std::snprintf(text.data(), text.size(), "%012" PRIx64, value);
  return text.data();
}

nlohmann::ordered_json vector_json(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::ordered_json cube_json(const TileKey& tile, const CubeRecord& cube) {
  const CubeKey key = cube_at(tile, cube.index);
  return {{"index", cube.index},
          {"x", key.x},
          {"y", key.y},
          {"z", key.z},
          {"status", name_of(cube.status)},
          {"class", name_of(cube.cube_class)},
          {"failure", name_of(cube.failure)},
          {"num_gaussians", cube.gaussians.size()},
          {"num_iterations", cube.num_iterations},
          {"mae", cube.errors.mae},
          {"rmse", cube.errors.rmse},
          {"p95", cube.errors.p95},
          {"max", cube.errors.max},
          {"reach", cube.reach},
          {"input", hex(cube.input)}};
}

std::string cubes_text(const TileRecord& record) {
  Table table(Table::Alignment::kRight);
  table.add({"cube (x, y, z)", "status", "class", "gaussians", "mae", "rmse", "p95", "max",
             "reach (m)", "iterations"});
  for (const CubeRecord& cube : record.cubes) {
    const CubeKey key = cube_at(record.key, cube.index);
    const auto metres = [](float value) { return fixed(static_cast<double>(value), 4); };
    table.add({std::to_string(key.x) + ", " + std::to_string(key.y) + ", " + std::to_string(key.z),
               name_of(cube.status), name_of(cube.cube_class), grouped(cube.gaussians.size()),
               metres(cube.errors.mae), metres(cube.errors.rmse), metres(cube.errors.p95),
               metres(cube.errors.max), metres(cube.reach), std::to_string(cube.num_iterations)});
  }
  return table.text();
}

std::string points_text(const TileView& view) {
  if (!view.points) return "none";
  return grouped(view.points->num_points) + " in " + std::to_string(view.points->cubes.count()) +
         " cubes";
}

std::string state_text(const TileState& state) {
  return std::to_string(state.num_cubes) + ", " + std::to_string(state.num_populated) +
         " populated, " + std::to_string(state.num_poor) + " poor, " +
         std::to_string(state.num_failed) + " failed; " + grouped(state.num_gaussians) +
         " Gaussians, " + byte_text(static_cast<std::uint64_t>(state.num_bytes));
}

}  // namespace

std::string tile_text(const TileView& view) {
  Table table(Table::Alignment::kLeft);
  table.add({"tile", key_text(view.key)});
  table.add({"from", point_text(view.box.min()) + " m"});
  table.add({"to", point_text(view.box.max()) + " m"});
  table.add({"points", points_text(view)});
  table.add({"cubes", view.state ? state_text(*view.state)
                                 : std::string(view.points ? "none yet: not trained" : "none")});
  return table.text() + (view.record ? "\n" + cubes_text(*view.record) : "");
}

nlohmann::ordered_json tile_state_json(const TileState& state) {
  return {{"level", state.key.level},
          {"x", state.key.x},
          {"y", state.key.y},
          {"z", state.key.z},
          {"num_cubes", state.num_cubes},
          {"num_populated", state.num_populated},
          {"num_poor", state.num_poor},
          {"num_failed", state.num_failed},
          {"num_gaussians", state.num_gaussians},
          {"mean_mae", state.mean_mae},
          {"max_mae", state.max_mae},
          {"num_bytes", state.num_bytes},
          {"content_digest", state.content.hex()}};
}

nlohmann::ordered_json tile_json(const TileView& view) {
  TileState state;
  state.key = view.key;
  nlohmann::ordered_json json = tile_state_json(view.state.value_or(state));
  json["trained"] = view.state.has_value();
  json["num_points"] = view.points ? view.points->num_points : 0;
  json["bounds_min"] = vector_json(view.box.min());
  json["bounds_max"] = vector_json(view.box.max());
  json["cubes"] = nlohmann::ordered_json::array();
  if (!view.record) return json;
  for (const CubeRecord& cube : view.record->cubes)
    json["cubes"].push_back(cube_json(view.key, cube));
  return json;
}

std::string tile_row_heading() {
  return "level        x        y        z  cubes  populated  poor  failed  gaussians  "
         "mean mae (m)  max mae (m)      bytes\n";
}

std::string tile_row(const TileState& state) {
  std::array<char, 256> text;
  std::snprintf(text.data(), text.size(),
                "%5d %8d %8d %8d  %5d  %9d  %4d  %6d  %9lld  %12.4f  %11.4f  %9lld\n",
                state.key.level, state.key.x, state.key.y, state.key.z, state.num_cubes,
                state.num_populated, state.num_poor, state.num_failed,
                static_cast<long long>(state.num_gaussians), state.mean_mae, state.max_mae,
                static_cast<long long>(state.num_bytes));
  return text.data();
}

}  // namespace gdfmap::cli
