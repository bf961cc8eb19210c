#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <gdfmap/gdf1/model.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/map/map.hpp>
#include <gdfmap/pipeline/ingest.hpp>

namespace gdfmap::cli {

struct CloudView {
  CloudInfo info;
  std::uint64_t num_read = 0;
  std::uint64_t num_finite = 0;
  std::uint64_t num_withheld = 0;
  Box3 bounds;  ///< of the finite points, in the frame and units of the file
};

struct ModelView {
  std::string format;
  ModelSummary summary;
  std::uint64_t num_cubes = 0;  ///< that can be used
  std::uint64_t num_gaussians = 0;
};

/// What points.db holds.
struct PointsView {
  std::vector<SourceRecord> sources;
  PointStore::Totals totals;
  TrainingEstimate estimate;
};

struct MapView {
  std::string id;
  Geometry geometry;
  bool is_imported = false;
  std::optional<PointsView> points;
  CubeTotals cubes;
  Box3 bounds;                  ///< of the occupied cubes, as training last saw them
  std::uint64_t num_bytes = 0;  ///< of all files of the map
  Digest content_digest;
};
[[nodiscard]] MapView look_into_map(Map& map);

[[nodiscard]] std::string info_text(const CloudView& view);
[[nodiscard]] std::string info_text(const ModelView& view);
[[nodiscard]] std::string info_text(const MapView& view);
[[nodiscard]] nlohmann::ordered_json info_json(const CloudView& view);
[[nodiscard]] nlohmann::ordered_json info_json(const ModelView& view);
[[nodiscard]] nlohmann::ordered_json info_json(const MapView& view);

}  // namespace gdfmap::cli
