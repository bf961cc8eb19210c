#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/pipeline/field_access.hpp>

#include "commands.hpp"
#include "field_source.hpp"
#include "options.hpp"
#include "sample_writer.hpp"
#include "session.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "query", "Distance, gradient, status and expected error at points",
    "Answers at points given one by one or as a cloud of any size. Columns: x, y, z, distance (m), "
    "gx, gy, gz (the gradient), status (fine, coarse, far: a lower bound, unknown) and "
    "expected_error (m). What is not known is nan in CSV and NPY, null in JSON; NPY holds float64 "
    "and the status as 0 fine, 1 coarse, 2 far, 3 unknown.",
    "  gdfmap query city.gdfmap --at 12,3.5,1.2 --at 0,0,0\n"
    "  gdfmap query city.gdfmap --points path.csv --format npy > field.npy\n"
    "  echo 12,3.5,1.2 | gdfmap query model.bin --points - --blend gdf1"};

constexpr std::size_t kPointsPerBatch = std::size_t{1} << 16;

struct Options {
  CommonOptions common;
  std::string path;
  std::vector<std::string> at;
  std::string points;
  std::string format = "csv";
  BlendOption blend;
};

/// Answers a batch and writes it.
void answer(const DistanceField& field, std::span<const Vector3> points_world,
            std::vector<FieldSample>& samples, SampleWriter& writer) {
  samples.resize(points_world.size());
  field.at(points_world, samples);
  writer.write(points_world, samples);
}

void answer_cloud(const DistanceField& field, const std::string& path, SampleWriter& writer) {
  const std::unique_ptr<PointReader> reader = open_point_cloud(path);
  std::vector<Vector3> points_world(kPointsPerBatch);
  std::vector<FieldSample> samples;
  while (const std::size_t count = reader->read(points_world)) {
    answer(field, std::span(points_world).first(count), samples, writer);
  }
}

std::vector<Vector3> parse_points(const std::vector<std::string>& texts) {
  std::vector<Vector3> points;
  for (const std::string& text : texts) points.push_back(parse_point(text, "--at"));
  return points;
}

void run(const Options& options) {
  if (options.at.empty() == options.points.empty()) {
    throw Error(ErrorCode::kUsage, "either --at or --points must be given");
  }
  const std::vector<Vector3> points_world = parse_points(options.at);
  const Session session(options.common, OnSignal::kEnd);
  DistanceFieldOptions how;
  how.cache_bytes = session.context().memory() / 2;
  how.blend = options.blend.mode();
  how.num_threads = session.context().num_threads;
  const DistanceField field(open_trained_source(options.path), how);

  const std::unique_ptr<SampleWriter> writer = make_sample_writer(options.format);
  if (options.points.empty()) {
    std::vector<FieldSample> samples;
    answer(field, points_world, samples, *writer);
  } else {
    answer_cloud(field, options.points, *writer);
  }
  writer->finish();
  throw_if_unreadable(field);
}

}  // namespace

Command add_query(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP|MODEL", options->path, "A map, or a GDF1 (.bin) or CSV (.csv) model")
      ->required();
  CLI::Option* const at =
      app->add_option("--at", options->at, "A point in metres, world frame; may be repeated")
          ->option_text("X,Y,Z")
          ->allow_extra_args(false);
  app->add_option("--points", options->points,
                  "A cloud of points in any format that ingest reads; - is standard input")
      ->option_text("FILE|-")
      ->excludes(at);
  app->add_option("--format", options->format,
                  "csv, json (an array of objects) or npy; default " + options->format)
      ->option_text("FORMAT")
      ->check(CLI::IsMember({"csv", "json", "npy"}));
  add_blend_option(*app, options->blend);
  add_common_options(*app, options->common, kThreads | kMemory);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
