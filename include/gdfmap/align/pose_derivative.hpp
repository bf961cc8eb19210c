#pragma once

#include <vector>

#include <gdfmap/align/registration.hpp>
#include <gdfmap/align/surface_factor.hpp>

namespace gdfmap {

/// How the pose that minimises point-to-plane distances follows the points of the source.
struct PoseDerivative {
  /// The minimum for the frozen matches, in local frames.
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  /// Of every point p of the source, dξ/dp: when p moves by δ (its own frame), T becomes
  /// exp(dξ/dp·δ)·T. Zero for points without a match.
  std::vector<Eigen::Matrix<double, 6, 3>> by_point;

  /// Covariance of ξ when every point has independent errors of this standard deviation, metres:
  /// H⁻¹ (Σ Jᵀ Σ J) H⁻¹.
  [[nodiscard]] Matrix6 covariance(double sigma) const;
};

/// By implicit differentiation: at the minimum the gradient g(ξ, p) of the cost vanishes, so that
/// dξ/dp = −(∂g/∂ξ)⁻¹ ∂g/∂p, with the full Hessian of the robust cost rather than Gauss and
/// Newton's.
/// @param factor  kPlane, its matches made
/// @param T       near the minimum, from where Newton's method goes on to it
/// @throws Error kUsage for another residual, and where the matches leave the pose undetermined
[[nodiscard]] PoseDerivative differentiate_pose(const SurfaceFactor& factor,
                                                const Eigen::Isometry3d& T,
                                                const RobustKernel& kernel);

/// The same for the thinned points of a scan, source.surface(options.voxel), at a pose that
/// `gradicp` found: ξ stands about target.origin_world(), p relative to source.origin(). A point of
/// the scan itself counts as its voxel's mean over the number of points in the voxel.
[[nodiscard]] PoseDerivative differentiate_gradicp(const MapWindow& target, const Scan& source,
                                                   const Eigen::Isometry3d& T_target_source,
                                                   const RegistrationOptions& options);

}  // namespace gdfmap
