#include <array>
#include <cmath>
#include <vector>

#include <ceres/ceres.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/fit/optimizers.hpp>

namespace gdfmap {
namespace {

/// All residuals of a cube as one dense block, evaluated sample by sample: deliberately without the
/// tensor structure that it is an oracle for.
class DenseCost final : public ceres::CostFunction {
 public:
  DenseCost(const CubeProblem& problem, Eigen::Index num_gaussians)
      : problem_(problem), weights_(axis_weights(problem.grid)), num_gaussians_(num_gaussians) {
    set_num_residuals(num_samples());
    mutable_parameter_block_sizes()->push_back(
        static_cast<std::int32_t>(kFitParameters * num_gaussians));
  }

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    using Jacobian =
        Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
    const Eigen::Map<const FitParameters<double>> p(parameters[0], kFitParameters, num_gaussians_);
    const Eigen::Array3Xd inverse_sigma = (-p.bottomRows<3>().array()).exp();
    double* const derivatives = jacobians != nullptr ? jacobians[0] : nullptr;
    Jacobian jacobian(derivatives, derivatives != nullptr ? num_samples() : 0, p.size());
    const TrainingGrid& grid = problem_.grid;
    for (int i = 0; i < num_samples(); ++i) {
      const int n = grid.per_axis();
      const std::array<int, 3> at = {i / (n * n), i / n % n, i % n};
      const Eigen::Array3d x(grid.position(at[0]), grid.position(at[1]), grid.position(at[2]));
      const double root_weight = std::sqrt(weight(at[0]) * weight(at[1]) * weight(at[2]));
      double model = 0.0;
      for (Eigen::Index k = 0; k < num_gaussians_; ++k) {
        const Eigen::Array3d u = (x - p.col(k).segment<3>(kFitMean).array()) * inverse_sigma.col(k);
        const double shape = std::exp(-0.5 * u.square().sum());
        const double value = p(kFitWeight, k) * shape;
        model += value;
        if (derivatives == nullptr) continue;
        auto row = jacobian.row(i).segment<kFitParameters>(kFitParameters * k);
        row[kFitWeight] = root_weight * shape;
        row.segment<3>(kFitMean) = (root_weight * value * u * inverse_sigma.col(k)).matrix();
        row.segment<3>(kFitLogSigma) = (root_weight * value * u.square()).matrix();
      }
      const double target =
          problem_.scale * static_cast<double>(problem_.targets[static_cast<std::size_t>(i)]);
      residuals[i] = root_weight * (model - target);
    }
    return true;
  }

 private:
  [[nodiscard]] int num_samples() const { return static_cast<int>(problem_.grid.size()); }
  [[nodiscard]] double weight(int i) const { return weights_[static_cast<std::size_t>(i)]; }

  CubeProblem problem_;
  std::vector<double> weights_;  // along an axis
  Eigen::Index num_gaussians_;
};

void set_bounds(ceres::Problem& problem, double* parameters, Eigen::Index num_gaussians) {
  for (int k = 0; k < num_gaussians; ++k) {
    for (int a = 0; a < 3; ++a) {
      const int mean = kFitParameters * k + kFitMean + a;
      problem.SetParameterLowerBound(parameters, mean, kMinMean);
      problem.SetParameterUpperBound(parameters, mean, kMaxMean);
      const int log_sigma = kFitParameters * k + kFitLogSigma + a;
      problem.SetParameterLowerBound(parameters, log_sigma, kMinLogSigma);
      problem.SetParameterUpperBound(parameters, log_sigma, kMaxLogSigma);
    }
  }
}

}  // namespace

void minimize_ceres(OptimizerJob<double>& job, const OptimizerOptions& options) {
  double* const parameters = job.parameters.data();
  ceres::Problem ceres_problem;
  ceres_problem.AddResidualBlock(new DenseCost(job.problem, job.parameters.cols()), nullptr,
                                 parameters);
  set_bounds(ceres_problem, parameters, job.parameters.cols());

  ceres::Solver::Options solver_options;
  solver_options.max_num_iterations = options.max_iterations;
  solver_options.function_tolerance = options.function_tolerance;
  solver_options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  solver_options.num_threads = 1;
  solver_options.max_solver_time_in_seconds = 1e9;  // iterations alone decide, never the clock
  solver_options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options, &ceres_problem, &summary);
  job.cost = summary.final_cost;
  job.num_iterations = static_cast<int>(summary.iterations.size());
}

DenseEvaluation evaluate_with_ceres(const CubeProblem& problem,
                                    const FitParameters<double>& parameters) {
  const DenseCost cost(problem, parameters.cols());
  DenseEvaluation result;
  result.residuals.resize(cost.num_residuals());
  result.jacobian.resize(cost.num_residuals(), parameters.size());
  const double* const blocks[] = {parameters.data()};
  double* jacobians[] = {result.jacobian.data()};
  if (!cost.Evaluate(blocks, result.residuals.data(), jacobians)) {
    throw Error(ErrorCode::kInternal, "the dense cost function cannot be evaluated");
  }
  return result;
}

}  // namespace gdfmap
