#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <gdfmap/edt/sample_lattice.hpp>

namespace gdfmap {

/// Parameters of one Gaussian in the problem's vector, in units of the cube's edge. The last three
/// are logarithms of the standard deviations.
enum FitParameter : int {
  kFitWeight = 0,
  kFitMean = 1,
  kFitLogSigma = 4,
  kFitParameters = 7,
};

/// Seven rows (FitParameter), one column per Gaussian.
template <typename Scalar>
using FitParameters = Eigen::Matrix<Scalar, kFitParameters, Eigen::Dynamic>;

/// Bounds that every solver keeps: means in [−1, 2], standard deviations in [0.04, 4] edges.
inline constexpr double kMinMean = -1.0, kMaxMean = 2.0;
inline constexpr double kMinLogSigma = -3.2188758248682006, kMaxLogSigma = 1.3862943611198906;

/// The least-squares problem of one cube: cost = ½ Σ_i ω_i (Σ_k w_k b_k(x_i) − t_i)².
struct CubeProblem {
  std::span<const float> targets;      ///< metres, x slowest, z fastest; not owned
  double scale = 1.0;                  ///< 1 / edge: brings targets to edges
  TrainingGrid grid = kPopulatedGrid;  ///< where the targets are
};

/// Weights of a grid's samples along an axis: 1 inside the cube; in the margin, where the cube's
/// share in the blended field falls, that share, but at least 0.15, since GDF1 readers give an
/// outermost cube full weight there. A sample counts with the product of its three weights ω.
[[nodiscard]] std::vector<double> axis_weights(const TrainingGrid& grid);

}  // namespace gdfmap
