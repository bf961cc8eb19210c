#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <gdfmap/align/map_window.hpp>
#include <gdfmap/align/minimize.hpp>
#include <gdfmap/align/rigid_motion.hpp>
#include <gdfmap/align/scan.hpp>

namespace gdfmap {

enum class RegistrationStatus {
  kConverged,      ///< the pose is trusted
  kMaxIterations,  ///< passes the gates, but steps had not become small
  kTooFew,         ///< too few points in the scan, the target, or in common
  kDegenerate,     ///< what the scan sees leaves some motion undetermined: a plane, a corridor
  kRejected,       ///< too little of the scan lies on the target
};
/// "converged", "max_iterations", "too_few", "degenerate", "rejected"
[[nodiscard]] const char* name_of(RegistrationStatus status);
/// Whether the pose may be used.
[[nodiscard]] bool is_usable(RegistrationStatus status);

struct RegistrationOptions {
  double voxel = 0.25;        ///< edge of the voxels that clouds are thinned to, metres
  int max_iterations = 0;     ///< of each stage; 0: the method's own
  double max_distance = 0.0;  ///< of a correspondence, metres; 0: the method's own
  /// @name Gates
  /// @{
  std::size_t min_points = 100;   ///< thinned points of the scan that lie on the target
  double min_inlier_ratio = 0.6;  ///< of the scan's thinned points, in [0, 1]
  /// Of the points that tell a direction apart, for the direction where it is least: on its floor
  /// alone a scan lies anywhere in a building.
  double min_direction_ratio = 0.4;
  /// Least eigenvalue of the information, relative: the mean square of the normals' components, and
  /// for rotations of their leverages as a share of the root mean square lever about the axis.
  double min_eigenvalue = 0.004;
  /// @}
  int num_threads = 0;  ///< 0: one per core; changes no bit
};

/// What is known of a pose, besides the pose. Frames: those of the target.
struct RegistrationResult {
  Eigen::Isometry3d T_target_source = Eigen::Isometry3d::Identity();
  RegistrationStatus status = RegistrationStatus::kTooFew;
  std::string reason;  ///< one line for people, empty when converged
  int iterations = 0;  ///< over all stages

  /// Share of the scan's thinned points that lie on the target: their nearest neighbour there is
  /// within two voxels, its surface within 0.4 of a voxel, and both normals within 45 degrees.
  double inlier_ratio = 0.0;
  /// The same share in the direction that has the least of it: every point counts with the square
  /// of its normal's component.
  double direction_ratio = 0.0;
  double rmse = 0.0;           ///< distance of the inliers from the target's surface, metres
  std::size_t num_points = 0;  ///< thinned points of the scan
  std::size_t num_inliers = 0;

  /// Of a small motion (v, ω) about `center`, from distances along the target's normals:
  /// Σ JᵀJ / rmse², J = [nᵀ, ((s − center) × n)ᵀ]. In 1/m², 1/m and 1.
  Vector3 center = Vector3::Zero();  ///< mean of the inliers
  Matrix6 information = Matrix6::Zero();
  /// The inverse of the information in the directions that are observed, and nothing in the others.
  Matrix6 covariance = Matrix6::Zero();
  /// Relative, ascending; rotations in units of the inliers' levers about the axis. At most 1.
  Twist eigenvalues = Twist::Zero();
  /// Motions (v, ω) about `center` that nothing seen determines, unit vectors in that scaling.
  std::vector<Twist> unobservable;
};

/// A way to find the pose of a scan: a sequence of stages, each a residual, an optimiser, a kernel
/// and a resolution. Immutable and thread-safe.
class RegistrationMethod {
 public:
  virtual ~RegistrationMethod() = default;

  /// Never throws for what the clouds hold; a pose that cannot be trusted says so in its status.
  /// @param T_init  first guess of T_target_source, a rigid motion
  /// @throws Error kUsage for options out of range, or a field that the target has not
  [[nodiscard]] virtual RegistrationResult provide(const MapWindow& target, const Scan& source,
                                                   const Eigen::Isometry3d& T_init,
                                                   const RegistrationOptions& options) const = 0;
};

/// Names that make_registration_method knows.
[[nodiscard]] std::span<const char* const> registration_method_names();

/// icp-point, icp-plane, gicp, gradicp (point-to-plane with the gates of gradLM), ndt, field, or
/// auto: ndt in cells of eight and of four voxels, then gicp.
/// @throws Error kUsage for another name
[[nodiscard]] std::unique_ptr<RegistrationMethod> make_registration_method(std::string_view name);

/// The pose that follows from known ones, T_world_target⁻¹ · T_world_source, judged like any other;
/// the first guess is not used.
[[nodiscard]] std::unique_ptr<RegistrationMethod> make_truth(
    const Eigen::Isometry3d& T_world_target, const Eigen::Isometry3d& T_world_source);

}  // namespace gdfmap
