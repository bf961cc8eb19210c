#include <gdfmap/core/error.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/pipeline/build.hpp>
#include <gdfmap/pipeline/new_map_guard.hpp>

namespace gdfmap {
namespace {

/// Refuses, before anything changes, a map that holds another cloud than the configured one.
void check_source(Map& map, const std::filesystem::path& cloud, const RunContext& context) {
  const std::vector<SourceRecord> sources = map.points().sources();
  if (sources.empty()) return;
  if (sources.size() == 1 && find_published(cloud.string(), {}, map.points(), context)) return;
  throw Error(ErrorCode::kUsage,
              map.path().string() + " holds " + sources.front().path +
                  (sources.size() > 1 ? " and others" : "") + ", not " + cloud.string() +
                  " as it is now; choose another io.output_base or delete the map");
}

}  // namespace

BuildReport build(const Configuration& configuration, const RunContext& outer) {
  if (configuration.input_file.empty() || configuration.output_base.empty()) {
    throw Error(ErrorCode::kUsage, "io.input_file and io.output_base must be set");
  }
  RunContext context = outer;
  if (context.num_threads == 0) context.num_threads = configuration.num_threads;

  BuildReport report;
  report.map = configuration.output_base + ".gdfmap";
  const std::unique_ptr<PointReader> cloud = open_point_cloud(configuration.input_file);
  const bool is_new = !std::filesystem::exists(report.map);
  Map map = open_or_create_map(report.map, configuration.geometry(), context);
  NewMapGuard guard(map, is_new);
  check_source(map, configuration.input_file, context);
  report.ingest =
      ingest_points(*cloud, configuration.input_file, map.lattice(), map.points(), {}, context);
  guard.keep();
  // The file says what the map shall be: other values than last time fit it again.
  report.train = train(map, {configuration.fit_config(map.geometry().cube_size), true}, context);
  if (configuration.export_bin) {
    report.bin = export_model(map, configuration.output_base + ".bin", std::nullopt, context);
  }
  if (configuration.export_csv) {
    report.csv = export_model(map, configuration.output_base + ".csv", std::nullopt, context);
  }
  return report;
}

}  // namespace gdfmap
