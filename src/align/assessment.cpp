#include "assessment.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>

#include <gdfmap/core/run_context.hpp>

#include "chunked_sum.hpp"

namespace gdfmap {
namespace {

/// A point of the scan on the target's surface.
struct Inlier {
  Vector3 s;        ///< the point, local target frame
  Vector3 n;        ///< the target's normal
  double distance;  ///< along it
};

/// What the inliers of a pose sum up to.
struct Inliers {
  std::vector<Inlier> points;
  Eigen::Matrix3d all_normals = Eigen::Matrix3d::Zero();  ///< Σ m mᵀ of all points of the scan
  Eigen::Matrix3d inlier_normals = Eigen::Matrix3d::Zero();

  Inliers& operator+=(const Inliers& other) {
    points.insert(points.end(), other.points.begin(), other.points.end());
    all_normals += other.all_normals;
    inlier_normals += other.inlier_normals;
    return *this;
  }
};

Inliers find_inliers(const SurfaceCloud& target, const SurfaceCloud& source,
                     const Eigen::Isometry3d& T, double voxel, int num_threads) {
  return chunked_sum<Inliers>(source.size(), num_threads, [&](std::size_t begin, std::size_t end) {
    Inliers part;
    for (std::size_t i = begin; i < end; ++i) {
      const Vector3 s = T * source.points()[i], m = T.linear() * source.normals()[i];
      part.all_normals += m * m.transpose();
      const auto match = target.tree().nearest(s, OnSurface::kReach * voxel);
      if (!match) continue;
      const Vector3& n = target.normals()[*match];
      const auto distance = OnSurface::distance(s - target.points()[*match], m, n, voxel);
      if (!distance) continue;
      part.points.push_back({s, n, *distance});
      part.inlier_normals += m * m.transpose();
    }
    return part;
  });
}

/// The least of |inlier normals along a| / |all normals along a| over all directions a: the least
/// generalised eigenvalue. Directions that the scan has no normals along do not count.
double least_direction_ratio(const Inliers& inliers, double num_points) {
  constexpr double kLeastShare = 0.02;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> all(inliers.all_normals / num_points);
  double least = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (all.eigenvalues()[axis] < kLeastShare) continue;
    const Vector3 a = all.eigenvectors().col(axis);
    const double part = a.dot(inliers.inlier_normals * a) / num_points;
    least = std::min(least, part / all.eigenvalues()[axis]);
  }
  return least;
}

/// Centre, rmse and information of the inliers; lengths in the local target frame.
struct Geometry6 {
  Vector3 center = Vector3::Zero();
  /// The means of |arm|² I − arm armᵀ: along an axis, the mean square lever about it.
  Eigen::Matrix3d levers = Eigen::Matrix3d::Zero();
  Matrix6 normals = Matrix6::Zero();  ///< Σ JᵀJ about the centre
  double rmse = 0.0;
};

Geometry6 geometry_of(const std::vector<Inlier>& inliers) {
  Geometry6 g;
  const double n = static_cast<double>(inliers.size());
  for (const Inlier& inlier : inliers) g.center += inlier.s / n;
  double squares = 0.0;
  for (const Inlier& inlier : inliers) {
    const Vector3 arm = inlier.s - g.center;
    Twist J;
    J << inlier.n, arm.cross(inlier.n);
    g.normals += J * J.transpose();
    squares += inlier.distance * inlier.distance;
    g.levers += (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose()) / n;
  }
  g.rmse = std::sqrt(squares / n);
  return g;
}

/// M^(−1/2) of a symmetric matrix, small eigenvalues raised.
Eigen::Matrix3d inverse_root(const Eigen::Matrix3d& M) {
  constexpr double kLeast = 1e-6;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(M);
  const Vector3 eigenvalues = solver.eigenvalues().cwiseMax(kLeast * M.trace());
  return solver.eigenvectors() * eigenvalues.cwiseSqrt().cwiseInverse().asDiagonal() *
         solver.eigenvectors().transpose();
}

/// Information, covariance, eigenvalues and the motions that are not observed.
void describe_information(const Geometry6& g, double num_inliers, double min_eigenvalue,
                          RegistrationResult& result) {
  constexpr double kLeastNoise = 1e-4;  // a lattice step: exact data must not give certainty
  const double noise = std::max(g.rmse, kLeastNoise);
  result.information = g.normals / (noise * noise);
  Matrix6 unit = Matrix6::Identity();
  unit.bottomRightCorner<3, 3>() = inverse_root(g.levers);
  const Matrix6 relative = unit * g.normals * unit / num_inliers;
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(relative);
  result.eigenvalues = solver.eigenvalues();
  result.covariance.setZero();
  for (int i = 0; i < 6; ++i) {
    const Twist axis = solver.eigenvectors().col(i);
    if (result.eigenvalues[i] < min_eigenvalue) {
      result.unobservable.push_back(axis);
      continue;
    }
    const Twist scaled = unit * axis;
    result.covariance +=
        noise * noise / (num_inliers * result.eigenvalues[i]) * scaled * scaled.transpose();
  }
}

std::string percent(double share) { return std::to_string(std::lround(100.0 * share)) + " %"; }

/// The first gate that the result does not pass.
void judge(const RegistrationOptions& options, bool converged, RegistrationResult& result) {
  const auto refuse = [&](RegistrationStatus status, const std::string& reason) {
    result.status = status;
    result.reason = reason;
  };
  if (result.num_inliers < options.min_points) {
    const bool is_small = result.num_points < options.min_points;
    refuse(is_small ? RegistrationStatus::kTooFew : RegistrationStatus::kRejected,
           "only " + std::to_string(result.num_inliers) + " of " +
               std::to_string(result.num_points) + " thinned points lie on the target");
  } else if (result.inlier_ratio < options.min_inlier_ratio) {
    refuse(RegistrationStatus::kRejected, "only " + percent(result.inlier_ratio) +
                                              " of the scan lies on the target, " +
                                              percent(options.min_inlier_ratio) + " are wanted");
  } else if (result.direction_ratio < options.min_direction_ratio) {
    refuse(RegistrationStatus::kRejected, "in one direction only " +
                                              percent(result.direction_ratio) +
                                              " of the surfaces that face it lie on the target, " +
                                              percent(options.min_direction_ratio) + " are wanted");
  } else if (!result.unobservable.empty()) {
    refuse(RegistrationStatus::kDegenerate, "what is seen leaves " +
                                                std::to_string(result.unobservable.size()) +
                                                " of 6 degrees of freedom undetermined");
  } else if (!converged) {
    refuse(RegistrationStatus::kMaxIterations, "steps had not become small");
  } else {
    refuse(RegistrationStatus::kConverged, "");
  }
}

/// Below them there is nothing to describe: six degrees of freedom are met by any six points.
constexpr std::size_t kLeastInliers = 12;

}  // namespace

void assess(const MapWindow& target, const Scan& source, const RegistrationOptions& options,
            bool converged, RegistrationResult& result) {
  const int threads = RunContext{options.num_threads}.threads();
  const SurfaceCloud& target_surface = target.surface(options.voxel, threads);
  const SurfaceCloud& source_surface = source.surface(options.voxel, threads);
  const Eigen::Isometry3d T =
      between_origins(result.T_target_source, target.origin_world(), source.origin());
  const Inliers inliers = find_inliers(target_surface, source_surface, T, options.voxel, threads);
  result.num_points = source_surface.size();
  result.num_inliers = inliers.points.size();
  if (result.num_inliers >= kLeastInliers) {
    const double num_points = static_cast<double>(result.num_points);
    const double num_inliers = static_cast<double>(result.num_inliers);
    const Geometry6 geometry = geometry_of(inliers.points);
    result.inlier_ratio = num_inliers / num_points;
    result.direction_ratio = least_direction_ratio(inliers, num_points);
    result.rmse = geometry.rmse;
    result.center = geometry.center + target.origin_world();
    describe_information(geometry, num_inliers, options.min_eigenvalue, result);
  }
  judge(options, converged, result);
}

}  // namespace gdfmap
