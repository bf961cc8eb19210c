#include <algorithm>
#include <array>
#include <cmath>

#include <gdfmap/align/registration.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/core/run_context.hpp>

#include "assessment.hpp"
#include "stage.hpp"

namespace gdfmap {
namespace {

constexpr KernelSchedule kCauchy{KernelKind::kCauchy, 1.0, 0.4, 0.6};

/// Names and stages. Lengths in voxels.
struct NamedStages {
  const char* name;
  std::vector<Stage> stages;
};

const std::vector<NamedStages>& named_stages() {
  using enum Residual;
  using enum Optimizer;
  static const std::vector<NamedStages> methods = {
      {"icp-point", {{kPoint, kGaussNewton, 1.0, 4.0, {KernelKind::kCauchy, 2.0, 0.5, 0.8}, 60}}},
      {"icp-plane", {{kPlane, kGaussNewton, 1.0, 4.0, kCauchy, 30}}},
      {"gicp", {{kGicp, kGaussNewton, 1.0, 4.0, kCauchy, 30}}},
      {"gradicp", {gradicp_stage()}},
      {"ndt",
       {{kNdt, kNewton, 2.0, 8.0, {}, 30, NdtNeighborhood::kFaces, 20.0},
        {kNdt, kNewton, 1.0, 3.0, {}, 30, NdtNeighborhood::kFaces}}},
      {"field",
       {{kField,
         kLevenbergMarquardt,
         1.0,
         1.0,
         {KernelKind::kCauchy, 0.5, 0.05, 0.8},
         60,
         NdtNeighborhood::kOwn,
         20.0,
         0.3},
        {kTwoSidedField, kGaussNewton, 1.0, 0.2, {KernelKind::kCauchy, 0.1, 0.02, 0.8}, 30}}},
      {"auto",
       {{kNdt, kNewton, 2.0, 8.0, {}, 30, NdtNeighborhood::kFaces, 20.0},
        {kNdt, kNewton, 1.0, 4.0, {}, 30, NdtNeighborhood::kOwn, 20.0},
        {kGicp, kGaussNewton, 1.0, 4.0, kCauchy, 30}}},
  };
  return methods;
}

void check(const Eigen::Isometry3d& T_init, const RegistrationOptions& options) {
  if (!(options.voxel > 0.0 && std::isfinite(options.voxel))) {
    throw Error(ErrorCode::kUsage, "the voxel of a registration must be positive");
  }
  const Eigen::Matrix3d R = T_init.linear();
  const bool is_rigid = T_init.matrix().allFinite() &&
                        (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-6 &&
                        R.determinant() > 0.0;
  if (!is_rigid) throw Error(ErrorCode::kUsage, "the first guess is no rigid transformation");
}

/// The result for clouds that are too small to be looked at; whether that is so.
bool is_too_small(const MapWindow& target, const Scan& source, const RegistrationOptions& options,
                  RegistrationResult& result) {
  const int threads = RunContext{options.num_threads}.threads();
  const std::size_t in_scan = source.surface(options.voxel, threads).size();
  const std::size_t in_target = target.surface(options.voxel, threads).size();
  result.num_points = in_scan;
  if (std::min(in_scan, in_target) >= options.min_points) return false;
  const char* const which = in_scan < options.min_points ? "scan" : "target";
  result.status = RegistrationStatus::kTooFew;
  result.reason = std::string("the ") + which + " has only " +
                  std::to_string(std::min(in_scan, in_target)) + " thinned points, " +
                  std::to_string(options.min_points) + " are wanted";
  return true;
}

class StagedMethod final : public RegistrationMethod {
 public:
  explicit StagedMethod(std::vector<Stage> stages) : stages_(std::move(stages)) {}

  RegistrationResult provide(const MapWindow& target, const Scan& source,
                             const Eigen::Isometry3d& T_init,
                             const RegistrationOptions& options) const override {
    check(T_init, options);
    RegistrationResult result;
    result.T_target_source = T_init;
    if (is_too_small(target, source, options, result)) return result;
    Minimum minimum{between_origins(T_init, target.origin_world(), source.origin())};
    const Stage* unmatched = nullptr;
    for (const Stage& stage : stages_) {
      const StageResult stage_result = run_stage(stage, target, source, minimum.T, options);
      minimum = stage_result.minimum;
      result.iterations += minimum.iterations;
      if (stage_result.matched < stage.min_matched) unmatched = &stage;
    }
    result.T_target_source = between_origins(minimum.T, -target.origin_world(), -source.origin());
    assess(target, source, options, minimum.converged, result);
    if (unmatched != nullptr) {
      result.status = RegistrationStatus::kRejected;
      result.reason = "less than " + std::to_string(std::lround(100.0 * unmatched->min_matched)) +
                      " % of the scan lies in the trained field";
    }
    return result;
  }

 private:
  std::vector<Stage> stages_;
};

class Truth final : public RegistrationMethod {
 public:
  explicit Truth(const Eigen::Isometry3d& T_target_source) : T_target_source_(T_target_source) {}

  RegistrationResult provide(const MapWindow& target, const Scan& source, const Eigen::Isometry3d&,
                             const RegistrationOptions& options) const override {
    check(T_target_source_, options);
    RegistrationResult result;
    result.T_target_source = T_target_source_;
    if (!is_too_small(target, source, options, result)) {
      assess(target, source, options, true, result);
    }
    return result;
  }

 private:
  Eigen::Isometry3d T_target_source_;
};

}  // namespace

const char* name_of(RegistrationStatus status) {
  switch (status) {
    case RegistrationStatus::kConverged:
      return "converged";
    case RegistrationStatus::kMaxIterations:
      return "max_iterations";
    case RegistrationStatus::kTooFew:
      return "too_few";
    case RegistrationStatus::kDegenerate:
      return "degenerate";
    case RegistrationStatus::kRejected:
      break;
  }
  return "rejected";
}

bool is_usable(RegistrationStatus status) {
  return status == RegistrationStatus::kConverged || status == RegistrationStatus::kMaxIterations;
}

std::span<const char* const> registration_method_names() {
  static const std::vector<const char*> names = [] {
    std::vector<const char*> result;
    for (const NamedStages& method : named_stages()) result.push_back(method.name);
    return result;
  }();
  return names;
}

std::unique_ptr<RegistrationMethod> make_registration_method(std::string_view name) {
  for (const NamedStages& method : named_stages()) {
    if (name == method.name) return std::make_unique<StagedMethod>(method.stages);
  }
  std::string known;
  for (const char* const method : registration_method_names()) {
    known += (known.empty() ? "" : ", ") + std::string(method);
  }
  throw Error(ErrorCode::kUsage,
              "unknown registration method '" + std::string(name) + "'; one of " + known);
}

std::unique_ptr<RegistrationMethod> make_truth(const Eigen::Isometry3d& T_world_target,
                                               const Eigen::Isometry3d& T_world_source) {
  return std::make_unique<Truth>(T_world_target.inverse() * T_world_source);
}

}  // namespace gdfmap
