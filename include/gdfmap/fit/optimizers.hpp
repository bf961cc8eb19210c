#pragma once

#include <gdfmap/fit/tensor_problem.hpp>

namespace gdfmap {

struct OptimizerOptions {
  int max_iterations = 20;
  double function_tolerance =
      1e-4;  ///< ends when an accepted step lowers the cost by a smaller share
};

template <typename Scalar>
struct OptimizerResult {
  typename TensorProblem<Scalar>::Parameters parameters;
  double cost = 0.0;
  int num_iterations = 0;
};

/// Levenberg–Marquardt with a gain-ratio update of the damping and clamped, projected steps.
/// A pure function of its arguments.
template <typename Scalar>
[[nodiscard]] OptimizerResult<Scalar> minimize_tensor(
    TensorProblem<Scalar>& problem, const typename TensorProblem<Scalar>::Parameters& start,
    const OptimizerOptions& options);

extern template OptimizerResult<float> minimize_tensor<float>(
    TensorProblem<float>&, const TensorProblem<float>::Parameters&, const OptimizerOptions&);
extern template OptimizerResult<double> minimize_tensor<double>(
    TensorProblem<double>&, const TensorProblem<double>::Parameters&, const OptimizerOptions&);

/// The same problem solved by Ceres, with its own dense Jacobian and the same bounds.
[[nodiscard]] OptimizerResult<double> minimize_ceres(const TensorProblem<double>& problem,
                                                     const TensorProblem<double>::Parameters& start,
                                                     const OptimizerOptions& options);

/// Ceres' residuals √ω (model − target), x slowest, and their Jacobian (row-major, kNumSamples × 7
/// K) at given parameters: what the normal equations of TensorProblem are checked against.
struct DenseEvaluation {
  Eigen::VectorXd residuals;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> jacobian;
};
[[nodiscard]] DenseEvaluation evaluate_with_ceres(
    const TensorProblem<double>& problem, const TensorProblem<double>::Parameters& parameters);

}  // namespace gdfmap
