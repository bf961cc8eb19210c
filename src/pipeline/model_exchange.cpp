#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/morton.hpp>
#include <gdfmap/pipeline/model_exchange.hpp>
#include <gdfmap/query/tile_source.hpp>

namespace gdfmap {
namespace {

/// Level-0 tiles with cubes, in Morton order. A tile is an aligned block of 8³ cubes, so that
/// Morton order within tiles is Morton order of all cubes.
std::vector<TileKey> tiles_in_order(Map& map) {
  std::vector<TileKey> keys;
  map.cubes().for_each_state([&](const TileState& state) {
    if (state.key.level == 0 && state.num_cubes > 0) keys.push_back(state.key);
  });
  std::sort(keys.begin(), keys.end(), in_morton_order<TileKey>);
  return keys;
}

std::uint64_t morton_in_tile(const CubeRecord& cube) {
  constexpr int n = kCubesPerTileAxis;
  return morton_code(static_cast<std::uint64_t>(cube.index % n),
                     static_cast<std::uint64_t>(cube.index / n % n),
                     static_cast<std::uint64_t>(cube.index / (n * n)));
}

/// Visits what an export holds, in order.
class ExportedCubes {
 public:
  ExportedCubes(Map& map, const std::optional<Box3>& region, const RunContext& context)
      : map_(map), region_(region), context_(context), keys_(tiles_in_order(map)) {}

  /// Calls visit(key, box, record) for every exported cube and counts what is left out.
  template <typename Visit>
  void for_each(ExportReport& report, const char* stage, const Visit& visit) const {
    std::uint64_t done = 0;
    for (const TileKey& tile : keys_) {
      context_.throw_if_stopped();
      auto record = map_.cubes().read(tile);
      if (!record) continue;
      std::sort(record->cubes.begin(), record->cubes.end(),
                [](const CubeRecord& a, const CubeRecord& b) {
                  return morton_in_tile(a) < morton_in_tile(b);
                });
      for (const CubeRecord& cube : record->cubes) {
        const CubeKey key = cube_at(tile, cube.index);
        const Box3 box = map_.lattice().cube_box(key);
        if (region_ && !region_->intersects(box)) continue;
        if (cube.status == CubeStatus::kPoor) ++report.num_poor;
        if (cube.status == CubeStatus::kFailed) ++report.num_failed;
        if (cube.status == CubeStatus::kFitted) visit(key, box, cube);
      }
      context_.progress({stage, ++done, keys_.size(), {}});
    }
  }

 private:
  Map& map_;
  const std::optional<Box3>& region_;
  const RunContext& context_;
  std::vector<TileKey> keys_;
};

float standard_deviation(const CubeErrors& errors) {
  const double variance =
      static_cast<double>(errors.rmse) * errors.rmse - static_cast<double>(errors.mae) * errors.mae;
  return static_cast<float>(std::sqrt(std::max(variance, 0.0)));
}

/// Sums of the header's figures.
struct Totals {
  Gdf1Header header;
  double mae = 0.0, deviation = 0.0;

  void add(const Box3& box, const CubeErrors& errors) {
    ++header.num_cubes;
    header.bounds.extend(box);
    mae += errors.mae;
    deviation += standard_deviation(errors);
  }
  void finish(const Geometry& geometry) {
    header.average_mae = static_cast<float>(mae / header.num_cubes);
    header.average_standard_deviation = static_cast<float>(deviation / header.num_cubes);
    header.cube_size = geometry.cube_size;
    header.margin = geometry.margin;
  }
};

}  // namespace

ExportReport export_model(Map& map, const std::filesystem::path& path,
                          const std::optional<Box3>& region, const RunContext& context) {
  static_cast<void>(model_format(path));
  const ExportedCubes cubes(map, region, context);
  ExportReport report;
  Totals totals;
  cubes.for_each(report, "cubes measured",
                 [&](const CubeKey&, const Box3& box, const CubeRecord& cube) {
                   totals.add(box, cube.errors);
                 });
  if (totals.header.num_cubes == 0) {
    throw Error(ErrorCode::kUsage,
                map.path().string() + (region ? " has no fitted cube in this region"
                                              : " has no fitted cube: train it first"));
  }
  totals.finish(map.geometry());
  report.shift = export_shift(totals.header.bounds, map.geometry().cube_size);
  if (const auto warning = export_warning(totals.header.bounds, map.geometry().cube_size)) {
    context.warn(*warning);
  }

  const auto writer =
      create_model(path, map.geometry().cube_size, report.shift, map.cubes().content_digest());
  ExportReport ignored;
  cubes.for_each(
      ignored, "tiles written", [&](const CubeKey& key, const Box3&, const CubeRecord& cube) {
        writer->write({key, cube.errors.mae, standard_deviation(cube.errors), cube.gaussians});
        ++report.num_cubes;
        report.num_gaussians += cube.gaussians.size();
      });
  writer->finish(totals.header);
  return report;
}

ImportReport import_model(const std::filesystem::path& model_path,
                          const std::filesystem::path& map_path, const RunContext& context) {
  if (Map::exists(map_path)) {
    throw Error(ErrorCode::kUsage, map_path.string() + " already is a map");
  }
  const Model model = read_model(model_path);
  const std::vector<TileRecord> tiles = tiles_of_model(model.cubes);
  Map map = Map::create_imported(map_path, {model.header.cube_size, model.header.margin, 1});
  map.cubes().set_occupied(cubes_as_occupied(tiles));
  context.throw_if_stopped();
  map.cubes().put(tiles);
  ImportReport report{model.cubes.size(), 0, model.counts};
  for (const Gdf1Cube& cube : model.cubes) report.num_gaussians += cube.gaussians.size();
  return report;
}

}  // namespace gdfmap
