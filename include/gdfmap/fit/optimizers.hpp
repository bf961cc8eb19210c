#pragma once

#include <span>
#include <vector>

#include <gdfmap/fit/cube_problem.hpp>
#include <gdfmap/fit/tensor_batch.hpp>

namespace gdfmap {

struct OptimizerOptions {
  int max_iterations = 20;
  double function_tolerance =
      1e-4;  ///< ends when an accepted step lowers the cost by a smaller share
};

/// One problem and where to start; the result replaces the start.
template <typename Scalar>
struct OptimizerJob {
  CubeProblem problem;
  FitParameters<Scalar> parameters;
  double cost = 0.0;  ///< at the result
  int num_iterations = 0;
};

/// Levenberg–Marquardt with a gain-ratio update of the damping and clamped, projected steps, for
/// jobs with equal numbers of Gaussians, one a lane. A job's result depends on that job alone. A
/// lane that is done early waits for the others: practically all use up their iterations.
/// @param batch  lane i holds the problem of job i (checked), and keeps it; large enough for the
///               jobs
/// @param jobs   at most as many as there are lanes
template <typename Scalar>
void minimize_tensor(TensorBatch<Scalar>& batch, std::span<OptimizerJob<Scalar>> jobs,
                     const OptimizerOptions& options);

extern template void minimize_tensor<float>(TensorBatch<float>&, std::span<OptimizerJob<float>>,
                                            const OptimizerOptions&);
extern template void minimize_tensor<double>(TensorBatch<double>&, std::span<OptimizerJob<double>>,
                                             const OptimizerOptions&);

/// The same problem solved by Ceres, with its own dense Jacobian and the same bounds.
void minimize_ceres(OptimizerJob<double>& job, const OptimizerOptions& options);

/// Ceres' residuals √ω (model − target), x slowest, and their Jacobian (row-major, samples × 7 K)
/// at given parameters: what the normal equations of TensorBatch are checked against.
struct DenseEvaluation {
  Eigen::VectorXd residuals;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> jacobian;
};
[[nodiscard]] DenseEvaluation evaluate_with_ceres(const CubeProblem& problem,
                                                  const FitParameters<double>& parameters);

}  // namespace gdfmap
