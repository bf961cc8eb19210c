#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/pipeline/aligned_ingest.hpp>
#include <gdfmap/pipeline/configuration.hpp>
#include <gdfmap/pipeline/ingest.hpp>
#include <gdfmap/pipeline/new_map_guard.hpp>

#include "alignment_report.hpp"
#include "commands.hpp"
#include "estimate.hpp"
#include "ingest_report.hpp"
#include "options.hpp"
#include "session.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr Help kHelp = {
    "ingest", "Stream point clouds into a map, which is created when missing",
    "Reads PLY, PCD, LAS and XYZ/CSV files of any size in bounded memory and stores their points "
    "in compressed tiles. The same cloud again changes nothing; an ingest that is interrupted or "
    "fails leaves no trace of that cloud. Train the map afterwards.",
    "  gdfmap ingest city.gdfmap scan1.ply scan2.las\n"
    "  gdfmap ingest survey.gdfmap feet.las --scale 0.3048 --cube-size 4\n"
    "  gdfmap ingest city.gdfmap dense.las --voxel 0.02 --region=-50,-50,0,50,50,30\n"
    "  gdfmap ingest city.gdfmap scan1_corrected.ply --replace 1\n"
    "  gdfmap ingest street.gdfmap scan0.pcd scan1.pcd scan2.pcd --poses poses.txt\n"
    "  gdfmap ingest street.gdfmap --align next_week.ply\n"
    "  zcat scan.xyz.gz | gdfmap ingest city.gdfmap -"};

struct Options {
  CommonOptions common;
  std::string map;
  std::vector<std::string> clouds;
  GeometryChoice geometry;
  std::string config;
  double scale = 1.0;
  std::string transform;
  std::string poses;
  std::string sensor_origin;
  std::string align;  ///< a method; empty: clouds are taken where they are
  bool drop_zero = false;
  std::string region;
  double voxel = 0.0;
  std::optional<std::int64_t> replace;
};

/// The option where it is given, else the file's key.
template <typename Value>
std::optional<Value> chosen(const char* option, const std::optional<Value>& given,
                            const std::string& file, const std::optional<Value>& configured) {
  if (given && configured && *given != *configured) {
    throw Error(ErrorCode::kUsage, std::string(option) + " contradicts " + file);
  }
  return given ? given : configured;
}

GeometryChoice geometry_choice(const Options& options) {
  if (options.config.empty()) return options.geometry;
  const GeometryChoice configured = load_configuration(options.config).geometry();
  return {chosen("--cube-size", options.geometry.cube_size, options.config, configured.cube_size),
          chosen("--levels", options.geometry.num_levels, options.config, configured.num_levels)};
}

std::string joined_method_names() {
  std::string names;
  for (const char* const name : registration_method_names()) {
    names += (names.empty() ? "" : ", ") + std::string(name);
  }
  return names;
}

/// Finds a cloud that cannot be read before hours are spent on the others.
void check_clouds(const std::vector<std::string>& clouds) {
  for (const std::string& cloud : clouds) {
    if (cloud != "-") static_cast<void>(open_point_cloud(cloud));
  }
}

IngestOptions ingest_options(const Options& options) {
  IngestOptions result;
  result.transform.scale = options.scale;
  if (!options.transform.empty()) {
    result.transform.T_map_source = read_transform(options.transform);
  }
  if (!options.sensor_origin.empty()) {
    result.sensor_origin_source = parse_point(options.sensor_origin, "--sensor-origin");
  }
  result.drop_zero = options.drop_zero;
  if (!options.region.empty()) result.region = parse_box(options.region, "--region");
  result.voxel_size = options.voxel;
  result.replaced_source = options.replace;
  return result;
}

/// For each cloud.
std::vector<IngestOptions> options_of_clouds(const Options& options) {
  const IngestOptions common = ingest_options(options);
  const std::size_t num_clouds = options.clouds.size();
  if (options.poses.empty()) return std::vector<IngestOptions>(num_clouds, common);
  return posed_options(common, options.poses, num_clouds);
}

/// Ingests one cloud after the other; people see each as it is done.
std::vector<IngestReport> ingest_all(const Options& options, const std::vector<IngestOptions>& how,
                                     Map& map, Session& session) {
  std::vector<IngestReport> reports;
  for (std::size_t i = 0; i < options.clouds.size(); ++i) {
    reports.push_back(ingest(options.clouds[i], map, how[i], session.context()));
    if (!session.json()) session.print(ingest_text(reports.back()));
  }
  return reports;
}

/// What ingest did, as both reports tell it.
struct Outcome {
  std::vector<AlignmentReport> alignments;
  std::vector<IngestReport> sources;
};

/// Registers the clouds with the map and ingests all of them or none.
Outcome align_all(const Options& options, const std::vector<IngestOptions>& how, Map& map,
                  Session& session) {
  AlignmentOptions alignment;
  alignment.method = options.align;
  const std::vector<std::filesystem::path> clouds(options.clouds.begin(), options.clouds.end());
  AlignedIngestReport report = ingest_aligned(clouds, how, map, alignment, session.context());
  if (!session.json()) {
    for (const AlignmentReport& one : report.alignments) session.print(alignment_text(one));
    for (const IngestReport& one : report.sources) session.print(ingest_text(one));
  }
  return {std::move(report.alignments), std::move(report.sources)};
}

nlohmann::ordered_json outcome_json(const Outcome& outcome, const std::string& map) {
  nlohmann::ordered_json json = ingest_json(outcome.sources);
  json["alignments"] = nlohmann::ordered_json::array();
  for (const AlignmentReport& one : outcome.alignments) {
    json["alignments"].push_back(alignment_json(one));
  }
  json["map"] = map;
  return json;
}

void run(const Options& options) {
  Session session(options.common, OnSignal::kStop);
  const std::vector<IngestOptions> how = options_of_clouds(options);
  const GeometryChoice geometry = geometry_choice(options);
  if (options.replace && options.clouds.size() != 1) {
    throw Error(ErrorCode::kUsage, "--replace puts one cloud in the place of one source, not " +
                                       std::to_string(options.clouds.size()));
  }
  check_clouds(options.clouds);

  const bool is_new = !std::filesystem::exists(options.map);
  Map map = open_or_create_map(options.map, geometry, session.context());
  NewMapGuard guard(map, is_new);
  const Outcome outcome = options.align.empty()
                              ? Outcome{{}, ingest_all(options, how, map, session)}
                              : align_all(options, how, map, session);
  const TrainingEstimate estimate = estimate_training(map);
  if (!outcome.sources.empty()) guard.keep();
  if (session.json()) {
    nlohmann::ordered_json json = outcome_json(outcome, options.map);
    json["seconds"] = session.seconds();
    json["estimate"] = estimate_json(estimate);
    session.print_json(json);
  } else {
    session.print("training    " + estimate_text(estimate) + "\n");
  }
  throw_if_not_aligned(outcome.alignments);
}

}  // namespace

Command add_ingest(CLI::App& program) {
  const auto options = std::make_shared<Options>();
  CLI::App* const app = add_subcommand(program, kHelp);
  app->add_option("MAP", options->map, "Directory of the map, NAME.gdfmap")->required();
  app->add_option("CLOUD", options->clouds,
                  "Point clouds, recognised by their content; - is standard input")
      ->required();
  add_number(*app, "--cube-size", options->geometry.cube_size, "M", {0.001, 10000.0},
             "Edge of a cube in metres; fixed when the map is created, 1 unless given");
  app->add_option("--levels", options->geometry.num_levels,
                  "1 to 3: with coarser cubes, of 4 and 16 times the edge, a distance is known up "
                  "to 32 edges away; fixed when the map is created, 3 unless given")
      ->option_text("N")
      ->check(CLI::Range(1, kMaxLevels));
  app->add_option("--config", options->config,
                  "YAML file, of which cube_size and levels are used here (see gdfmap build)")
      ->option_text("FILE");
  add_number(*app, "--scale", options->scale, "S", {1e-9, 1e9},
             "Metres per unit of the file, applied first: 0.3048 for feet");
  app->add_option("--transform", options->transform,
                  "4 x 4 row-major matrix as text: a rigid motion into the map's frame, in metres, "
                  "applied after --scale")
      ->option_text("FILE");
  app->add_option("--poses", options->poses,
                  "Text with one pose of the sensor a line, the first for the first cloud and so "
                  "on: 12 numbers of a 3 x 4 row-major matrix (KITTI) or 8 of time, x, y, z, qx, "
                  "qy, qz, qw (TUM). Each cloud is a scan in its sensor's frame; --transform is "
                  "applied after the pose")
      ->option_text("FILE");
  app->add_option("--sensor-origin", options->sensor_origin,
                  "Where the sensor stood, in the frame and units of the file, so that it moves "
                  "with the points; kept with the source. Unless given: 0,0,0 with --poses, the "
                  "place of a PCD's VIEWPOINT, or not known")
      ->option_text("X,Y,Z");
  // A flag, so that a cloud that follows is not taken for the method.
  app->add_flag("--align{auto}", options->align,
                "Register each cloud with the map first, from where --transform or its pose puts "
                "it, and move it onto the map. If one of them does not fit, nothing is ingested, "
                "and the exit code is 6. --align=METHOD is one of " +
                    joined_method_names() + "; auto unless given")
      ->option_text("[=METHOD]");
  app->add_flag("--drop-zero", options->drop_zero,
                "Leave out points that are exactly (0, 0, 0) in the file");
  app->add_option(
         "--region", options->region,
         "Leave out points outside this box in the map's frame, in metres; its lower faces "
         "belong to it, its upper ones do not")
      ->option_text("X0,Y0,Z0,X1,Y1,Z1");
  add_number(*app, "--voxel", options->voxel, "M", {0.0, 10000.0},
             "Keep one point of every voxel with edges of this many metres, at most those of a "
             "cube; 0 keeps all. Clouds of one voxel size are thinned together");
  app->add_option("--replace", options->replace,
                  "Id of the source that the cloud replaces, in one step: interrupted, the map has "
                  "the old one (see gdfmap sources)")
      ->option_text("ID");
  add_common_options(*app, options->common, kThreads | kMemory | kProgress | kJson);
  return {app, [options] { run(*options); }};
}

}  // namespace gdfmap::cli
