#include "stage.hpp"

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

std::unique_ptr<Factor> make_factor(const Stage& stage, const MapWindow& target, const Scan& source,
                                    const RegistrationOptions& options) {
  const int threads = RunContext{options.num_threads}.threads();
  const SurfaceCloud& scan = source.surface(stage.voxel * options.voxel, threads);
  if (stage.residual == Residual::kNdt) {
    const NdtCells& cells = target.cells(stage.max_distance * options.voxel);
    return std::make_unique<NdtFactor>(cells, scan.points(),
                                       NdtFactor::Options{stage.neighborhood, threads});
  }
  const double max_distance =
      options.max_distance > 0.0 ? options.max_distance : stage.max_distance * options.voxel;
  return std::make_unique<SurfaceFactor>(
      target.surface(stage.voxel * options.voxel, threads), scan,
      SurfaceFactor::Options{surface_residual(stage.residual), max_distance, threads});
}

}  // namespace

Minimum run_stage(const Stage& stage, const MapWindow& target, const Scan& source,
                  const Eigen::Isometry3d& T, const RegistrationOptions& options) {
  const std::unique_ptr<Factor> factor = make_factor(stage, target, source, options);
  MinimizeOptions how;
  how.max_iterations = options.max_iterations > 0 ? options.max_iterations : stage.max_iterations;
  how.kernel = stage.kernel;
  how.kernel.first *= options.voxel;
  how.kernel.last *= options.voxel;
  return minimize(*factor, *make_rule(stage.optimizer), T, how);
}

}  // namespace gdfmap
