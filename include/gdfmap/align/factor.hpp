#pragma once

#include <cstddef>

#include <gdfmap/align/rigid_motion.hpp>
#include <gdfmap/align/robust_kernel.hpp>

namespace gdfmap {

/// A cost and its quadratic model around a pose: cost(ξ) ≈ cost + gradientᵀξ + ½ ξᵀ·hessian·ξ, all
/// of them means over the points of the source, so that they do not depend on their number.
struct Linearization {
  Matrix6 hessian = Matrix6::Zero();
  Twist gradient = Twist::Zero();
  double cost = 0.0;

  Linearization& operator+=(const Linearization& other) {
    hessian += other.hessian;
    gradient += other.gradient;
    cost += other.cost;
    return *this;
  }
  /// Of a sum over `count` points; of none it is the sum.
  [[nodiscard]] Linearization mean_over(std::size_t count) const {
    const double n = count == 0 ? 1.0 : static_cast<double>(count);
    return {hessian / n, gradient / n, cost / n};
  }
};

/// What a registration minimises: a mean over the points of a source, laid on a target by a pose
/// T_target_source. Both are in local frames (see MapWindow). match() chooses what every point is
/// compared with; from then on cost() and linearize() are pure functions of the pose, so that costs
/// before and after a step compare like with like. A point without a match costs as much as one at
/// the limit of the matches: losing points is never rewarded.
///
/// Sums are made in chunks of fixed size, added in order: no bit depends on the threads. One thread
/// at a time may call match(); the others are thread-safe.
class Factor {
 public:
  virtual ~Factor() = default;

  virtual void match(const Eigen::Isometry3d& T) = 0;
  /// Points of the source that have a match.
  [[nodiscard]] virtual std::size_t num_matched() const = 0;

  [[nodiscard]] virtual double cost(const Eigen::Isometry3d& T,
                                    const RobustKernel& kernel) const = 0;
  [[nodiscard]] virtual Linearization linearize(const Eigen::Isometry3d& T,
                                                const RobustKernel& kernel) const = 0;

  /// The pose that a step leads to, of which linearize() gives the derivatives.
  [[nodiscard]] virtual Eigen::Isometry3d retract(const Eigen::Isometry3d& T,
                                                  const Twist& step) const {
    return exp_twist(step) * T;
  }
};

}  // namespace gdfmap
