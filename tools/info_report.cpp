#include "info_report.hpp"

#include <filesystem>
#include <system_error>

#include <nlohmann/json.hpp>

#include <gdfmap/pipeline/field_access.hpp>

#include "estimate.hpp"
#include "ingest_report.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

std::uint64_t bytes_below(const std::filesystem::path& directory) {
  std::uint64_t sum = 0;
  std::error_code error;  // a file may vanish meanwhile: a writer's log, for one
  for (const auto& entry : std::filesystem::directory_iterator(directory, error)) {
    const std::uintmax_t size = entry.file_size(error);
    if (!error) sum += size;
  }
  return sum;
}

nlohmann::ordered_json vector_json(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

/// Null for a box without points.
void add_bounds(nlohmann::ordered_json& json, const Box3& bounds) {
  json["bounds_min"] = nullptr;
  json["bounds_max"] = nullptr;
  if (bounds.isEmpty()) return;
  json["bounds_min"] = vector_json(bounds.min());
  json["bounds_max"] = vector_json(bounds.max());
}

void add_bounds(Table& table, const Box3& bounds, const std::string& unit) {
  if (bounds.isEmpty()) {
    table.add({"bounds", "none"});
    return;
  }
  table.add({"from", point_text(bounds.min()) + unit});
  table.add({"to", point_text(bounds.max()) + unit});
}

nlohmann::ordered_json points_json(const PointsView& points) {
  nlohmann::ordered_json sources = nlohmann::ordered_json::array();
  for (const SourceRecord& source : points.sources) sources.push_back(source_json(source));
  return {{"num_points", points.totals.num_points}, {"num_blocks", points.totals.num_blocks},
          {"num_tiles", points.totals.num_tiles},   {"block_bytes", points.totals.block_bytes},
          {"sources", std::move(sources)},          {"estimate", estimate_json(points.estimate)}};
}

nlohmann::ordered_json cubes_json(const CubeTotals& cubes) {
  return {{"num_tiles", cubes.num_tiles},
          {"num_cubes", cubes.num_cubes},
          {"num_populated", cubes.num_populated},
          {"num_empty", cubes.num_cubes - cubes.num_populated},
          {"num_poor", cubes.num_poor},
          {"num_failed", cubes.num_failed},
          {"num_gaussians", cubes.num_gaussians},
          {"num_bytes", cubes.num_bytes},
          {"mean_mae", cubes.mean_mae}};
}

void add_points(Table& table, const PointsView& points) {
  table.add({"sources", std::to_string(points.sources.size())});
  for (const SourceRecord& source : points.sources) {
    table.add({"", std::to_string(source.id) + ": " + source.path + ", " +
                       grouped(source.counts.num_stored) + " points"});
  }
  table.add({"points", grouped(points.totals.num_points) + " in " +
                           grouped(points.totals.num_tiles) + " tiles, " +
                           byte_text(points.totals.block_bytes) + " compressed"});
  table.add({"training", estimate_text(points.estimate)});
}

void add_cubes(Table& table, const CubeTotals& cubes, bool is_imported) {
  if (cubes.num_cubes == 0) {
    table.add({"cubes", "none yet: run `gdfmap train`"});
    return;
  }
  std::string classes;
  if (!is_imported) {
    classes = " (" + grouped(cubes.num_populated) + " populated, " +
              grouped(cubes.num_cubes - cubes.num_populated) + " empty)";
  }
  table.add(
      {"cubes", grouped(cubes.num_cubes) + classes + " in " + grouped(cubes.num_tiles) + " tiles"});
  table.add({"", grouped(cubes.num_poor) + " poor, " + grouped(cubes.num_failed) + " failed"});
  table.add({"gaussians", grouped(cubes.num_gaussians) + ", " +
                              byte_text(static_cast<std::uint64_t>(cubes.num_bytes))});
  table.add({"mean error", fixed(cubes.mean_mae, 4) + " m"});
}

}  // namespace

MapView look_into_map(Map& map) {
  MapView view;
  view.id = map.id();
  view.geometry = map.geometry();
  view.is_imported = map.is_imported();
  if (!map.is_imported() && map.has_points()) {
    view.points = {map.points().sources(), map.points().totals(), estimate_training(map)};
  }
  view.cubes = map.cubes().totals();
  view.bounds = occupied_bounds(map.cubes().occupied(), map.lattice());
  view.num_bytes = bytes_below(map.path());
  view.content_digest = map.cubes().content_digest();
  return view;
}

std::string info_text(const CloudView& view) {
  Table table(Table::Alignment::kLeft);
  table.add({"format", view.info.format});
  table.add(
      {"points",
       grouped(view.num_read) + ", " + grouped(view.num_finite) + " of them finite" +
           (view.num_withheld > 0 ? ", " + grouped(view.num_withheld) + " more withheld" : "")});
  if (view.info.num_points) table.add({"declared", grouped(*view.info.num_points)});
  add_bounds(table, view.bounds, "");
  return table.text();
}

std::string info_text(const ModelView& view) {
  const Gdf1Header& header = view.summary.header;
  Table table(Table::Alignment::kLeft);
  table.add({"format", view.format});
  table.add(
      {"cubes", grouped(view.num_cubes) + " with " + grouped(view.num_gaussians) + " Gaussians"});
  table.add({"dropped", grouped(view.summary.counts.num_dropped_cubes) + " cubes, " +
                            grouped(view.summary.counts.num_dropped_gaussians) + " Gaussians"});
  table.add({"cube size", exact(header.cube_size) + " m, margin " + exact(header.margin) + " m"});
  table.add({"mean error", fixed(static_cast<double>(header.average_mae), 4) + " m"});
  add_bounds(table, header.bounds, " m");
  return table.text();
}

std::string info_text(const MapView& view) {
  Table table(Table::Alignment::kLeft);
  table.add({"map", view.id + (view.is_imported ? ", imported" : "")});
  table.add({"cube size", exact(view.geometry.cube_size) + " m, margin " +
                              exact(view.geometry.margin) + " m, levels " +
                              std::to_string(view.geometry.num_levels)});
  if (view.points) add_points(table, *view.points);
  add_cubes(table, view.cubes, view.is_imported);
  add_bounds(table, view.bounds, " m");
  table.add({"on disk", byte_text(view.num_bytes)});
  table.add({"content_digest", view.content_digest.hex()});
  return table.text();
}

nlohmann::ordered_json info_json(const CloudView& view) {
  nlohmann::ordered_json json = {{"kind", "cloud"}, {"format", view.info.format}};
  json["num_points"] = nullptr;
  if (view.info.num_points) json["num_points"] = *view.info.num_points;
  json["num_read"] = view.num_read;
  json["num_finite"] = view.num_finite;
  json["num_withheld"] = view.num_withheld;
  add_bounds(json, view.bounds);
  return json;
}

nlohmann::ordered_json info_json(const ModelView& view) {
  const Gdf1Header& header = view.summary.header;
  nlohmann::ordered_json json = {
      {"kind", "model"},
      {"format", view.format},
      {"num_cubes", view.num_cubes},
      {"num_gaussians", view.num_gaussians},
      {"num_dropped_cubes", view.summary.counts.num_dropped_cubes},
      {"num_dropped_gaussians", view.summary.counts.num_dropped_gaussians},
      {"average_mae", header.average_mae},
      {"average_standard_deviation", header.average_standard_deviation},
      {"cube_size", header.cube_size},
      {"margin", header.margin},
      {"empty_search_margin", header.empty_search_margin}};
  add_bounds(json, header.bounds);
  return json;
}

nlohmann::ordered_json info_json(const MapView& view) {
  nlohmann::ordered_json json = {{"kind", "map"},
                                 {"id", view.id},
                                 {"imported", view.is_imported},
                                 {"cube_size", view.geometry.cube_size},
                                 {"margin", view.geometry.margin},
                                 {"num_levels", view.geometry.num_levels},
                                 {"num_bytes", view.num_bytes},
                                 {"content_digest", view.content_digest.hex()}};
  add_bounds(json, view.bounds);
  json["points"] = nullptr;
  if (view.points) json["points"] = points_json(*view.points);
  json["trained"] = view.cubes.num_cubes > 0;
  json["cubes"] = cubes_json(view.cubes);
  return json;
}

}  // namespace gdfmap::cli
