#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <gdfmap/align/minimize.hpp>

#include "line_search.hpp"

namespace gdfmap {
namespace {

class GaussNewton final : public StepRule {
 public:
  Twist step(const Linearization& model, const Trial&) override { return damped_step(model, 0.0); }
};

class LevenbergMarquardt final : public StepRule {
 public:
  explicit LevenbergMarquardt(double damping) : initial_damping_(damping), damping_(damping) {}

  Twist step(const Linearization& model, const Trial& trial) override {
    constexpr double kFactor = 10.0, kLeast = 1e-9, kMost = 1e6;
    for (; damping_ <= kMost; damping_ *= kFactor) {
      const Twist candidate = damped_step(model, damping_);
      if (trial.cost(candidate) <= model.cost) {
        damping_ = std::max(kLeast, damping_ / kFactor);
        return candidate;
      }
    }
    // Nothing falls: this is the minimum, as far as can be told. Another kernel or other matches
    // may open a way again.
    damping_ = initial_damping_;
    return Twist::Zero();
  }

 private:
  double initial_damping_;
  double damping_;
};

class GradLm final : public StepRule {
 public:
  explicit GradLm(const GradLmOptions& options) : options_(options), damping_(options.damp) {}

  Twist step(const Linearization& model, const Trial& trial) override {
    const Twist whole = damped_step(model, damping_);
    const double change = grad_lm_change(model.cost, trial.cost(whole));
    damping_ *= grad_lm_damping_factor(change, options_);
    return grad_lm_gain(change, options_) * whole;
  }

 private:
  GradLmOptions options_;
  double damping_;
};

/// −H⁻¹·g with the absolute values of H's eigenvalues, small ones raised: a direction of descent.
Twist newton_direction(const Linearization& model) {
  // Metres and radians differ in scale: eigenvalues are taken where the diagonal is 1.
  constexpr double kLeastEigenvalue = 1e-3, kTiny = 1e-12;
  const Twist scale =
      model.hessian.diagonal().cwiseAbs().cwiseMax(kTiny).cwiseSqrt().cwiseInverse();
  const Matrix6 scaled = scale.asDiagonal() * model.hessian * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(scaled);
  const Twist inverse = solver.eigenvalues().cwiseAbs().cwiseMax(kLeastEigenvalue).cwiseInverse();
  const Twist gradient = scale.asDiagonal() * model.gradient;
  const Twist direction =
      solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose() * gradient;
  return -(scale.asDiagonal() * direction);
}

class Newton final : public StepRule {
 public:
  Twist step(const Linearization& model, const Trial& trial) override {
    const Twist direction = newton_direction(model);
    const double slope = model.gradient.dot(direction);
    if (!(slope < 0.0)) return Twist::Zero();
    const auto along = [&](double length) {
      const Linearization there = trial.linearize(length * direction);
      return LineValue{there.cost, there.gradient.dot(direction)};
    };
    return line_search({model.cost, slope}, along) * direction;
  }
};

}  // namespace

Twist damped_step(const Linearization& model, double damping) {
  // A diagonal this small against the largest says that the direction does not count at all.
  constexpr double kVanishing = 1e-12;
  const Twist diagonal = model.hessian.diagonal();
  const double floor = std::max(kVanishing * diagonal.maxCoeff(), 1e-300);
  Matrix6 damped = model.hessian;
  damped.diagonal() += damping * diagonal + Twist::Constant(floor);
  const Eigen::LDLT<Matrix6> ldlt(damped);
  return ldlt.solve(-model.gradient);
}

double grad_lm_change(double cost_before, double cost_after) {
  constexpr double kSteepness = 20.0, kTiny = 1e-30, kLimit = 70.0;
  const double relative = (cost_after - cost_before) / std::max(cost_before, kTiny);
  return std::clamp(kSteepness * relative, -kLimit, kLimit);
}

double grad_lm_gain(double change, const GradLmOptions& options) {
  return std::pow(1.0 + std::exp(options.B2 * change), -1.0 / options.nu);
}

double grad_lm_damping_factor(double change, const GradLmOptions& options) {
  const double most = options.lambda_max, least = 1.0 / options.lambda_max;
  return least + (most - least) / (1.0 + most * std::exp(-options.B * change));
}

std::unique_ptr<StepRule> make_gauss_newton() { return std::make_unique<GaussNewton>(); }
std::unique_ptr<StepRule> make_levenberg_marquardt(double initial_damping) {
  return std::make_unique<LevenbergMarquardt>(initial_damping);
}
std::unique_ptr<StepRule> make_grad_lm(const GradLmOptions& options) {
  return std::make_unique<GradLm>(options);
}
std::unique_ptr<StepRule> make_newton() { return std::make_unique<Newton>(); }

}  // namespace gdfmap
