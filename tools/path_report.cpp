#include "path_report.hpp"

#include <array>
#include <cmath>
#include <vector>

#include "sample_writer.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr int kDigits = 9;  // the parameters are float32: more would be noise

/// A named value as text of each format.
struct Cell {
  const char* name;
  std::string csv, json;
};
using Row = std::vector<Cell>;

void add(Row& row, const char* name, const std::string& text) {
  row.push_back({name, text, '"' + text + '"'});
}
void add(Row& row, const char* name, bool value) {
  const std::string text = value ? "true" : "false";
  row.push_back({name, text, text});
}
void add(Row& row, const char* name, double value) {
  const std::string text = std::isnan(value) ? "nan" : rounded(value, kDigits);
  row.push_back({name, text, std::isfinite(value) ? text : "null"});
}
void add_point(Row& row, const std::array<const char*, 3>& names, const Vector3& p) {
  for (int a = 0; a < 3; ++a) {
    const std::string text = exact(p[a]);
    row.push_back({names[static_cast<std::size_t>(a)], text, text});
  }
}

std::string csv_of(const std::vector<Row>& rows) {
  std::string text;
  for (const Cell& cell : rows.front()) text += (text.empty() ? "" : ",") + std::string(cell.name);
  for (const Row& row : rows) {
    text += '\n';
    for (std::size_t i = 0; i < row.size(); ++i) text += (i == 0 ? "" : ",") + row[i].csv;
  }
  return text + '\n';
}

std::string json_of(const Row& row) {
  std::string text;
  for (const Cell& cell : row) {
    text += (text.empty() ? "{\"" : ", \"") + std::string(cell.name) + "\": " + cell.json;
  }
  return text + '}';
}

const char* name_of(RayEnd end) {
  switch (end) {
    case RayEnd::kHit:
      return "hit";
    case RayEnd::kMaxRange:
      return "max_range";
    case RayEnd::kUnknown:
      break;
  }
  return "unknown";
}

Row row_of(const PathClearance& clearance) {
  Row row;
  add(row, "length", clearance.length);
  add(row, "distance", clearance.distance);
  add_point(row, {"x", "y", "z"}, clearance.place);
  add(row, "place_at", clearance.place_at);
  add(row, "status", std::string(status_name(clearance.status)));
  add(row, "lower_bound", clearance.lower_bound);
  add(row, "free_length", clearance.free_length);
  add(row, "is_free", clearance.is_free);
  add(row, "unknown_length", clearance.unknown_length);
  return row;
}

Row row_of(const Ray& ray, const RayHit& hit) {
  Row row;
  add_point(row, {"x", "y", "z"}, ray.origin_world);
  add_point(row, {"dx", "dy", "dz"}, ray.direction_world);
  add(row, "end", std::string(name_of(hit.end)));
  add(row, "range", hit.range);
  add(row, "free_range", hit.free_range);
  add_point(row, {"hit_x", "hit_y", "hit_z"}, hit.place);
  add(row, "distance", hit.sample.distance);
  add(row, "status", std::string(status_name(hit.sample.status)));
  return row;
}

}  // namespace

std::string clearance_text(const PathClearance& clearance, bool json) {
  const Row row = row_of(clearance);
  return json ? json_of(row) + '\n' : csv_of({row});
}

std::string rays_text(std::span<const Ray> rays, std::span<const RayHit> hits, bool json) {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < rays.size(); ++i) rows.push_back(row_of(rays[i], hits[i]));
  if (!json) return csv_of(rows);
  std::string text;
  for (const Row& row : rows) text += (text.empty() ? "[\n" : ",\n") + json_of(row);
  return text + "\n]\n";
}

}  // namespace gdfmap::cli
