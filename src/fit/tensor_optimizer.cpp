#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

#include <gdfmap/fit/optimizers.hpp>

namespace gdfmap {
namespace {

constexpr double kInitialDamping = 1e-2;
constexpr double kLeastDamping = 1e-9;
constexpr double kMostDamping = 1e9;
constexpr double kMostMeanStep = 0.3;      // edges
constexpr double kMostLogSigmaStep = 0.7;  // a factor of 2
constexpr double kWeightRidge = 1e-6;      // per sample
constexpr double kDiagonalFloor = 1e-12;   // of the largest diagonal entry

/// Damping factor after an accepted step, by how well the quadratic model foretold it.
double damping_factor(double gain_ratio) {
  if (gain_ratio > 0.75) return 0.2;
  if (gain_ratio > 0.25) return 0.5;
  return 1.5;
}
constexpr double kRejectedFactor = 6.0;

/// Range of a parameter by its row.
template <typename Scalar>
struct Bounds {
  std::array<Scalar, kFitParameters> low, high;

  Bounds() {
    for (std::size_t row = 0; row < kFitParameters; ++row) {
      const bool is_mean = row >= kFitMean && row < kFitLogSigma;
      const bool is_weight = row == kFitWeight;
      constexpr double kInfinity = std::numeric_limits<double>::infinity();
      low[row] = static_cast<Scalar>(is_weight ? -kInfinity
                                     : is_mean ? kMinMean
                                               : std::log(kMinSigma));
      high[row] = static_cast<Scalar>(is_weight ? kInfinity
                                      : is_mean ? kMaxMean
                                                : std::log(kMaxSigma));
    }
  }
};

/// Most that a step may change a parameter of a row.
double most_step(std::size_t row) {
  if (row == kFitWeight) return std::numeric_limits<double>::infinity();
  return row < kFitLogSigma ? kMostMeanStep : kMostLogSigmaStep;
}

/// Adds a step with every component clamped, and projects the result on the bounds.
template <typename Parameters, typename Vector>
Parameters stepped(const Parameters& from, const Vector& step) {
  using Scalar = typename Parameters::Scalar;
  static const Bounds<Scalar> bounds;
  Parameters to = from;
  for (Eigen::Index i = 0; i < from.size(); ++i) {
    const auto row = static_cast<std::size_t>(i % kFitParameters);
    const auto most = static_cast<Scalar>(most_step(row));
    to.data()[i] = std::clamp(from.data()[i] + std::clamp(step[i], -most, most), bounds.low[row],
                              bounds.high[row]);
  }
  return to;
}

/// Holds the parameters that stand at a bound and would leave it: their rows and columns become
/// those of the identity, so that the others do not count on a movement that cannot happen.
template <typename Parameters, typename Matrix, typename Vector>
void hold_active_bounds(const Parameters& parameters, Matrix& normal_matrix, Vector& gradient) {
  using Scalar = typename Parameters::Scalar;
  static const Bounds<Scalar> bounds;
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const auto row = static_cast<std::size_t>(i % kFitParameters);
    const Scalar value = parameters.data()[i];
    const bool leaves_low = value <= bounds.low[row] && gradient[i] > Scalar(0);
    const bool leaves_high = value >= bounds.high[row] && gradient[i] < Scalar(0);
    if (!leaves_low && !leaves_high) continue;
    normal_matrix.row(i).setZero();
    normal_matrix.col(i).setZero();
    normal_matrix(i, i) = Scalar(1);
    gradient[i] = Scalar(0);
  }
}

/// (JᵀJ + λ diag(JᵀJ) + ridge) δ = −Jᵀr.
template <typename Matrix, typename Vector>
Vector damped_step(const Matrix& normal_matrix, const Vector& gradient, double damping) {
  using Scalar = typename Matrix::Scalar;
  Matrix damped = normal_matrix;
  const Scalar floor = static_cast<Scalar>(kDiagonalFloor) * normal_matrix.diagonal().maxCoeff();
  for (Eigen::Index i = 0; i < damped.rows(); ++i) {
    damped(i, i) += static_cast<Scalar>(damping) * std::max(damped(i, i), floor) + floor;
    if (i % kFitParameters == kFitWeight) {
      damped(i, i) += static_cast<Scalar>(damping * kWeightRidge * kNumSamples);
    }
  }
  return damped.template selfadjointView<Eigen::Lower>().llt().solve(-gradient);
}

}  // namespace

template <typename Scalar>
OptimizerResult<Scalar> minimize_tensor(TensorProblem<Scalar>& problem,
                                        const typename TensorProblem<Scalar>::Parameters& start,
                                        const OptimizerOptions& options) {
  using Problem = TensorProblem<Scalar>;
  typename Problem::Matrix normal_matrix;
  typename Problem::Vector gradient;
  OptimizerResult<Scalar> best{start, static_cast<double>(problem.evaluate(start)), 0};
  problem.normal_equations(normal_matrix, gradient);
  hold_active_bounds(start, normal_matrix, gradient);
  double damping = kInitialDamping;
  while (best.num_iterations < options.max_iterations && damping < kMostDamping) {
    ++best.num_iterations;
    const typename Problem::Vector step = damped_step(normal_matrix, gradient, damping);
    typename Problem::Parameters candidate = stepped(best.parameters, step);
    const auto cost = static_cast<double>(problem.evaluate(candidate));
    if (!(cost < best.cost)) {  // also when it is not a number
      damping *= kRejectedFactor;
      continue;
    }
    using Flat = Eigen::Map<const typename Problem::Vector>;
    const typename Problem::Vector taken = Flat(candidate.data(), candidate.size()) -
                                           Flat(best.parameters.data(), best.parameters.size());
    const auto foretold =
        static_cast<double>(-taken.dot(gradient) - Scalar(0.5) * taken.dot(normal_matrix * taken));
    const double gain = best.cost - cost;
    const bool converged = gain <= options.function_tolerance * best.cost;
    best.parameters = std::move(candidate);
    best.cost = cost;
    if (converged) break;
    damping =
        std::max(damping * damping_factor(foretold > 0.0 ? gain / foretold : 0.0), kLeastDamping);
    problem.normal_equations(normal_matrix, gradient);
  }
  return best;
}

template OptimizerResult<float> minimize_tensor<float>(TensorProblem<float>&,
                                                       const TensorProblem<float>::Parameters&,
                                                       const OptimizerOptions&);
template OptimizerResult<double> minimize_tensor<double>(TensorProblem<double>&,
                                                         const TensorProblem<double>::Parameters&,
                                                         const OptimizerOptions&);

}  // namespace gdfmap
