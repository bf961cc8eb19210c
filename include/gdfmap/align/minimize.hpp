#pragma once

#include <functional>
#include <memory>

#include <gdfmap/align/factor.hpp>

namespace gdfmap {

/// A way from a quadratic model to a step. A rule may remember earlier steps: one rule for one
/// minimisation. Not thread-safe.
class StepRule {
 public:
  virtual ~StepRule() = default;

  /// What the rule may ask about a trial step: the linearisation there, and its cost alone, which
  /// is quicker.
  struct Trial {
    std::function<double(const Twist&)> cost;
    std::function<Linearization(const Twist&)> linearize;
  };
  [[nodiscard]] virtual Twist step(const Linearization& model, const Trial& trial) = 0;
};

/// The whole step, −hessian⁻¹·gradient.
[[nodiscard]] std::unique_ptr<StepRule> make_gauss_newton();

/// Marquardt's damping λ·diag(hessian), raised tenfold until the cost falls and lowered by as much
/// after a step that did.
[[nodiscard]] std::unique_ptr<StepRule> make_levenberg_marquardt(double initial_damping = 1e-4);

/// The smooth gates of gradLM (Jatavallabhula et al., gradSLAM, ICRA 2020), through which a
/// derivative can flow, with the sign of its step gate put right. With the costs r0 before and r1
/// after the damped step, Δ = 20·(r1 − r0)/r0, clamped to ±70:
///   damping ← damping·[λ₋ + (λ₊ − λ₋)/(1 + λ₊·exp(−B·Δ))], λ₊ = lambda_max, λ₋ = 1/λ₊
///   step    ← step / (1 + exp(B2·Δ))^(1/nu)
/// The damping is Marquardt's, relative to the diagonal.
struct GradLmOptions {
  double damp = 1e-8;
  double lambda_max = 2.0;
  double B = 1.0;
  double B2 = 1.0;
  double nu = 200.0;
};
[[nodiscard]] std::unique_ptr<StepRule> make_grad_lm(const GradLmOptions& options = {});
/// 20·(after − before)/before, clamped: the Δ above.
[[nodiscard]] double grad_lm_change(double cost_before, double cost_after);
/// The share of a step that is taken at this Δ.
[[nodiscard]] double grad_lm_gain(double change, const GradLmOptions& options);
[[nodiscard]] double grad_lm_damping_factor(double change, const GradLmOptions& options);

/// Newton's direction, with negative curvature turned round, and a step along it by Moré and
/// Thuente (ACM TOMS 20, 1994): sufficient decrease 1e-4, curvature 0.9.
[[nodiscard]] std::unique_ptr<StepRule> make_newton();

/// −(hessian + damping·diag(hessian))⁻¹·gradient, by LDLT; directions that the hessian says nothing
/// of stay zero.
[[nodiscard]] Twist damped_step(const Linearization& model, double damping);

struct MinimizeOptions {
  int max_iterations = 20;
  /// Done when a step is shorter than both.
  double translation_tolerance = 5e-4;  ///< metres
  double rotation_tolerance = 5e-5;     ///< radians
  KernelSchedule kernel;
};

struct Minimum {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  int iterations = 0;
  bool converged = false;
};

/// Alternates matching and one step of the rule, from T on, until steps are small and the kernel
/// has its last scale. Ends early, not converged, when too few points have a match or a step is not
/// finite.
[[nodiscard]] Minimum minimize(Factor& factor, StepRule& rule, const Eigen::Isometry3d& T,
                               const MinimizeOptions& options);

}  // namespace gdfmap
