#include "stage.hpp"

#include <gdfmap/align/field_factor.hpp>
#include <gdfmap/align/ndt_factor.hpp>
#include <gdfmap/align/surface_factor.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/core/run_context.hpp>

namespace gdfmap {
namespace {

std::unique_ptr<StepRule> make_rule(Optimizer optimizer) {
  switch (optimizer) {
    case Optimizer::kGaussNewton:
      return make_gauss_newton();
    case Optimizer::kLevenbergMarquardt:
      return make_levenberg_marquardt();
    case Optimizer::kGradLm:
      return make_grad_lm();
    case Optimizer::kNewton:
      break;
  }
  return make_newton();
}

SurfaceResidual surface_residual(Residual residual) {
  switch (residual) {
    case Residual::kPoint:
      return SurfaceResidual::kPoint;
    case Residual::kGicp:
      return SurfaceResidual::kGicp;
    default:
      return SurfaceResidual::kPlane;
  }
}

bool uses_field(const Stage& stage) {
  return stage.residual == Residual::kField || stage.residual == Residual::kTwoSidedField;
}

/// What a stage's lengths are in, metres: voxels, or cubes of a field, whose errors grow with them.
double unit_of(const Stage& stage, const MapWindow& target, const RegistrationOptions& options) {
  return uses_field(stage) ? target.field()->geometry().cube_size : options.voxel;
}

std::unique_ptr<Factor> make_field_factor(const Stage& stage, const MapWindow& target,
                                          const SurfaceCloud& source,
                                          const RegistrationOptions& options) {
  const double unit = unit_of(stage, target, options), max_distance = stage.max_distance * unit;
  const int threads = RunContext{options.num_threads}.threads();
  if (stage.residual == Residual::kField) {
    return std::make_unique<FieldFactor>(*target.field(), target.origin_world(), source.points(),
                                         FieldFactor::Options{max_distance, threads});
  }
  constexpr double kMinHalfWidth = 0.15, kMaxHalfWidth = 0.45;
  return std::make_unique<TwoSidedFieldFactor>(
      *target.field(), target.origin_world(), source,
      TwoSidedFieldFactor::Options{kMinHalfWidth * unit, kMaxHalfWidth * unit, max_distance,
                                   threads});
}

std::unique_ptr<Factor> make_factor(const Stage& stage, const MapWindow& target,
                                    const SurfaceCloud& scan, const RegistrationOptions& options) {
  const int threads = RunContext{options.num_threads}.threads();
  if (stage.residual == Residual::kNdt) {
    const NdtCells& cells = target.cells(stage.max_distance * options.voxel);
    return std::make_unique<NdtFactor>(cells, scan.points(),
                                       NdtFactor::Options{stage.neighborhood, threads});
  }
  if (uses_field(stage)) return make_field_factor(stage, target, scan, options);
  const double max_distance =
      options.max_distance > 0.0 ? options.max_distance : stage.max_distance * options.voxel;
  return std::make_unique<SurfaceFactor>(
      target.surface(stage.voxel * options.voxel, threads), scan,
      SurfaceFactor::Options{surface_residual(stage.residual), max_distance, threads});
}

}  // namespace

Stage gradicp_stage() {
  return {Residual::kPlane, Optimizer::kGradLm, 1.0, 4.0, {KernelKind::kCauchy, 1.0, 0.4, 0.6}, 30};
}

StageResult run_stage(const Stage& stage, const MapWindow& target, const Scan& source,
                      const Eigen::Isometry3d& T, const RegistrationOptions& options) {
  if (uses_field(stage) && target.field() == nullptr) {
    throw Error(ErrorCode::kUsage,
                "the target has no distance field; `field` wants a map that is trained");
  }
  const SurfaceCloud& scan =
      source.surface(stage.voxel * options.voxel, RunContext{options.num_threads}.threads());
  const std::unique_ptr<Factor> factor = make_factor(stage, target, scan, options);
  MinimizeOptions how;
  how.max_iterations = options.max_iterations > 0 ? options.max_iterations : stage.max_iterations;
  how.translation_tolerance *= stage.tolerance;
  how.rotation_tolerance *= stage.tolerance;
  how.kernel = stage.kernel;
  how.kernel.first *= unit_of(stage, target, options);
  how.kernel.last *= unit_of(stage, target, options);
  StageResult result{minimize(*factor, *make_rule(stage.optimizer), T, how)};
  result.matched = static_cast<double>(factor->num_matched()) / static_cast<double>(scan.size());
  return result;
}

}  // namespace gdfmap
