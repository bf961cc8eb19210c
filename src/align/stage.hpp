#pragma once

#include <gdfmap/align/registration.hpp>

namespace gdfmap {

enum class Residual { kPoint, kPlane, kGicp, kNdt, kField, kTwoSidedField };
enum class Optimizer { kGaussNewton, kLevenbergMarquardt, kGradLm, kNewton };

/// One minimisation of a method. Lengths are in voxels of RegistrationOptions; those of fields
/// but for `voxel` in cubes of the map.
struct Stage {
  Residual residual;
  Optimizer optimizer;
  double voxel = 1.0;         ///< that both clouds are thinned to
  double max_distance = 4.0;  ///< of a correspondence; of NDT the edge of a cell
  KernelSchedule kernel;      ///< scales
  int max_iterations = 30;
  NdtNeighborhood neighborhood = NdtNeighborhood::kOwn;
  /// How much longer steps may be where this one ends: a coarse one only leads to the next.
  double tolerance = 1.0;
  double min_matched = 0.0;  ///< least share of the scan with a match at the end, in [0, 1]
};

struct StageResult {
  Minimum minimum;
  double matched = 0.0;  ///< share of the scan's thinned points with a match
};

/// The stage of `gradicp`.
[[nodiscard]] Stage gradicp_stage();

/// Runs a stage from T on, in local frames. @throws Error kUsage for a field that is not there
[[nodiscard]] StageResult run_stage(const Stage& stage, const MapWindow& target, const Scan& source,
                                    const Eigen::Isometry3d& T, const RegistrationOptions& options);

}  // namespace gdfmap
