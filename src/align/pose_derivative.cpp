#include <cmath>

#include <Eigen/LU>

#include <gdfmap/align/pose_derivative.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/core/run_context.hpp>

#include "stage.hpp"

namespace gdfmap {
namespace {

/// A point-to-plane residual r = n·(T p − q) and its first derivative.
struct PlaneTerm {
  Vector3 s, n;
  double r;
  Twist J;

  PlaneTerm(const SurfaceFactor& factor, const Eigen::Isometry3d& T, std::size_t i,
            std::uint32_t match)
      : s(T * factor.source().points()[i]),
        n(factor.target().normals()[match]),
        r(n.dot(s - factor.target().points()[match])) {
    J << n, s.cross(n);
  }

  /// ∂²r: of exp(ξ)·s the terms of second order are ½ ω × v + ½ ω × (ω × s).
  [[nodiscard]] Matrix6 second() const {
    Matrix6 H = Matrix6::Zero();
    H.topRightCorner<3, 3>() = 0.5 * skew(n);
    H.bottomLeftCorner<3, 3>() = H.topRightCorner<3, 3>().transpose();
    H.bottomRightCorner<3, 3>() =
        0.5 * (n * s.transpose() + s * n.transpose()) - n.dot(s) * Eigen::Matrix3d::Identity();
    return H;
  }
};

struct NewtonModel {
  Matrix6 hessian = Matrix6::Zero();
  Twist gradient = Twist::Zero();
};

NewtonModel model_at(const SurfaceFactor& factor, const Eigen::Isometry3d& T,
                     const RobustKernel& kernel) {
  NewtonModel model;
  for (std::size_t i = 0; i < factor.source().size(); ++i) {
    const auto match = factor.matches()[i];
    if (!match) continue;
    const PlaneTerm term(factor, T, i, *match);
    const double size = std::abs(term.r), slope = kernel.weight(size) * term.r;
    model.gradient += slope * term.J;
    model.hessian += kernel.curvature(size) * term.J * term.J.transpose() + slope * term.second();
  }
  return model;
}

/// Newton's method; its last steps are as small as doubles allow.
Eigen::Isometry3d find_minimum(const SurfaceFactor& factor, Eigen::Isometry3d T,
                               const RobustKernel& kernel) {
  constexpr int kMaxIterations = 50;
  constexpr double kLeastStep = 1e-13;
  for (int i = 0; i < kMaxIterations; ++i) {
    const NewtonModel model = model_at(factor, T, kernel);
    const Twist step = -model.hessian.fullPivLu().solve(model.gradient);
    if (!step.allFinite() || step.norm() < kLeastStep) break;
    T = exp_twist(step) * T;
  }
  return T;
}

/// ∂g/∂p of one term, in the source's frame: ∂r/∂p = nᵀR, and of J's lower half −[n]× R.
Eigen::Matrix<double, 6, 3> gradient_by_point(const PlaneTerm& term, const Eigen::Matrix3d& R,
                                              const RobustKernel& kernel) {
  const double size = std::abs(term.r);
  Eigen::Matrix<double, 6, 3> result = kernel.curvature(size) * term.J * (term.n.transpose() * R);
  result.bottomRows<3>() -= kernel.weight(size) * term.r * skew(term.n) * R;
  return result;
}

}  // namespace

Matrix6 PoseDerivative::covariance(double sigma) const {
  Matrix6 sum = Matrix6::Zero();
  for (const auto& D : by_point) sum += D * D.transpose();
  return sigma * sigma * sum;
}

PoseDerivative differentiate_pose(const SurfaceFactor& factor, const Eigen::Isometry3d& T,
                                  const RobustKernel& kernel) {
  if (factor.residual() != SurfaceResidual::kPlane) {
    throw Error(ErrorCode::kUsage, "derivatives of a pose are those of point-to-plane residuals");
  }
  PoseDerivative result;
  result.T = find_minimum(factor, T, kernel);
  const Eigen::FullPivLU<Matrix6> hessian(model_at(factor, result.T, kernel).hessian);
  if (!hessian.isInvertible()) {
    throw Error(ErrorCode::kUsage, "the matches leave the pose undetermined: it has no derivative");
  }
  result.by_point.assign(factor.source().size(), Eigen::Matrix<double, 6, 3>::Zero());
  for (std::size_t i = 0; i < factor.source().size(); ++i) {
    const auto match = factor.matches()[i];
    if (!match) continue;
    const PlaneTerm term(factor, result.T, i, *match);
    result.by_point[i] = -hessian.solve(gradient_by_point(term, result.T.linear(), kernel));
  }
  return result;
}

PoseDerivative differentiate_gradicp(const MapWindow& target, const Scan& source,
                                     const Eigen::Isometry3d& T_target_source,
                                     const RegistrationOptions& options) {
  const Stage stage = gradicp_stage();
  const int threads = RunContext{options.num_threads}.threads();
  const double max_distance =
      options.max_distance > 0.0 ? options.max_distance : stage.max_distance * options.voxel;
  SurfaceFactor factor(target.surface(options.voxel, threads),
                       source.surface(options.voxel, threads),
                       {SurfaceResidual::kPlane, max_distance, threads});
  const Eigen::Isometry3d T =
      between_origins(T_target_source, target.origin_world(), source.origin());
  factor.match(T);
  return differentiate_pose(factor, T, {stage.kernel.kind, stage.kernel.last * options.voxel});
}

}  // namespace gdfmap
