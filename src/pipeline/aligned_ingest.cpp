#include <algorithm>

#include <gdfmap/core/error.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/pipeline/aligned_ingest.hpp>

#include "alignment_gates.hpp"
#include "scan_sample.hpp"

namespace gdfmap {
namespace {

/// Sampled points of a thinned one, along an edge: their mean is less noisy than each.
constexpr double kSamplesPerVoxelAxis = 4.0;

/// Of what is made of the map around a cloud.
constexpr std::size_t kWindowBytes = kMinAlignmentMemory / 2;

void check(std::span<const std::filesystem::path> clouds, std::span<const IngestOptions> options,
           const RunContext& context) {
  if (clouds.size() != options.size()) {
    throw Error(ErrorCode::kInternal, "every cloud has options of its own");
  }
  if (std::ranges::find(clouds, std::filesystem::path("-")) != clouds.end()) {
    throw Error(ErrorCode::kUsage,
                "a cloud that is to be aligned is read twice, which standard input cannot be");
  }
  if (context.memory() < kMinAlignmentMemory) {
    throw Error(ErrorCode::kUsage, "aligning needs a memory budget of at least " +
                                       std::to_string(kMinAlignmentMemory >> 20) + " MiB");
  }
  const auto replaces = [](const IngestOptions& o) { return o.replaced_source.has_value(); };
  if (std::ranges::any_of(options, replaces)) {
    throw Error(ErrorCode::kUsage,
                "a cloud would be aligned with the source that it replaces: remove that first");
  }
}

/// One cloud after the other against the same map.
class Aligner {
 public:
  Aligner(Map& map, const AlignmentOptions& options, const RunContext& context)
      : map_(map),
        options_(options),
        context_(context),
        method_(make_registration_method(options.method)) {
    if (options.method != "field") return;
    field_ = std::make_shared<DistanceField>(map);
    backward_method_ = make_registration_method("icp-plane");  // a scan has no field
  }

  [[nodiscard]] AlignmentReport align(const std::filesystem::path& cloud,
                                      const IngestOptions& how) const {
    const std::unique_ptr<PointReader> reader = open_point_cloud(cloud);
    const ScanSample sample = sample_scan(*reader, how, map_.lattice(),
                                          options_.registration.voxel / kSamplesPerVoxelAxis,
                                          options_.max_sample_points, context_);
    context_.info(cloud.string() + ": registering " + std::to_string(sample.p_nominal.size()) +
                  " of its points, one of every " + std::to_string(sample.voxel) + " m voxel");
    RegistrationOptions registration = options_.registration;
    registration.voxel = std::max(registration.voxel, sample.voxel);
    registration.num_threads = context_.threads();

    AlignmentReport report;
    report.path = cloud.string();
    report.method = options_.method;
    const MapWindow window(map_, sample.p_nominal, window_options());
    report.num_tiles_left_out = window.num_tiles_left_out();
    const Scan scan(sample.p_nominal);
    report.registration =
        method_->provide(window, scan, Eigen::Isometry3d::Identity(), registration);
    context_.throw_if_stopped();
    const RegistrationMethod& backward = backward_method_ ? *backward_method_ : *method_;
    judge_alignment({*method_, backward, window, sample.p_nominal, registration}, options_, report);
    return report;
  }

 private:
  [[nodiscard]] MapWindow::MapOptions window_options() const {
    MapWindow::MapOptions result;
    result.max_bytes = kWindowBytes;
    result.field = field_;
    return result;
  }

  Map& map_;
  const AlignmentOptions& options_;
  const RunContext& context_;
  std::unique_ptr<RegistrationMethod> method_;
  std::unique_ptr<RegistrationMethod> backward_method_;  ///< null: the same
  std::shared_ptr<const DistanceField> field_;
};

std::vector<IngestReport> ingest_survey(std::span<const std::filesystem::path> clouds,
                                        std::span<const IngestOptions> options, Map& map,
                                        const RunContext& context) {
  SurveyIngest survey(map.lattice(), map.points(), context);
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    const std::unique_ptr<PointReader> reader = open_point_cloud(clouds[i]);
    survey.stage(*reader, clouds[i].string(), options[i]);
  }
  return survey.publish();
}

}  // namespace

AlignedIngestReport ingest_aligned(std::span<const std::filesystem::path> clouds,
                                   std::span<const IngestOptions> options, Map& map,
                                   const AlignmentOptions& alignment, const RunContext& context) {
  check(clouds, options, context);
  const Aligner aligner(map, alignment, context);
  AlignedIngestReport report;
  std::vector<IngestOptions> aligned(options.begin(), options.end());
  bool all_accepted = true;
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    Alignment& found = aligned[i].alignment.emplace();
    found.method = alignment.method;
    if (find_published(clouds[i].string(), aligned[i], map.points(), context)) continue;
    const AlignmentReport& one =
        report.alignments.emplace_back(aligner.align(clouds[i], options[i]));
    all_accepted = all_accepted && one.accepted;
    found.T_map_nominal = one.registration.T_target_source;
    found.inlier_ratio = one.registration.inlier_ratio;
    found.rmse = one.registration.rmse;
  }
  if (all_accepted) report.sources = ingest_survey(clouds, aligned, map, context);
  return report;
}

}  // namespace gdfmap
