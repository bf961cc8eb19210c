#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <gdfmap/core/flush_to_zero.hpp>
#include <gdfmap/fit/cube_fit.hpp>
#include <gdfmap/fit/optimizers.hpp>

#include "pursuit.hpp"

namespace gdfmap {
namespace {

using Problem = TensorProblem<double>;
using Parameters = Problem::Parameters;

/// Ridge of the last solve for the weights, relative to the mean diagonal of their Gram matrix.
constexpr double kWeightRidge = 1e-9;

/// Rounds shapes to the stored precision, solves for the weights that suit the rounded shapes, and
/// rounds those.
Gaussians to_stored(Problem& problem, Parameters parameters, double edge) {
  Gaussians gaussians(static_cast<std::size_t>(parameters.cols()));
  for (std::size_t k = 0; k < gaussians.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      double& mean = parameters(kFitMean + axis, column);
      gaussians.at(kMeanX + a, k) = static_cast<float>(mean * edge);
      mean = gaussians.at(kMeanX + a, k) / edge;
      double& log_sigma = parameters(kFitLogSigma + axis, column);
      const auto root_sigma = static_cast<float>(std::sqrt(std::exp(log_sigma) * edge));
      gaussians.at(kRootSigmaX + a, k) = root_sigma;
      log_sigma = std::log(static_cast<double>(root_sigma) * root_sigma / edge);
    }
  }
  problem.evaluate(parameters);
  const Problem::Vector weights = problem.solve_weights(kWeightRidge);
  for (std::size_t k = 0; k < gaussians.size(); ++k) {
    gaussians.at(kWeight, k) = static_cast<float>(weights[static_cast<Eigen::Index>(k)] * edge);
  }
  return gaussians;
}

/// Errors of the stored Gaussians at the held-out samples, by the kernel that queries use.
CubeErrors held_out_errors(const Gaussians& gaussians, const CubeSamples& samples) {
  const Kernel kernel(gaussians);
  std::array<double, kHeldOutPerAxis> position;
  for (int i = 0; i < kHeldOutPerAxis; ++i) {
    position[static_cast<std::size_t>(i)] = held_out_position(i, samples.level) * samples.edge;
  }
  std::array<double, kNumHeldOut> errors;
  double sum = 0.0, sum_of_squares = 0.0;
  std::size_t i = 0;
  for (const double x : position) {
    for (const double y : position) {
      for (const double z : position) {
        const double error = std::abs(evaluate(kernel.view(), {x, y, z}) - samples.held_out[i]);
        sum += error;
        sum_of_squares += error * error;
        errors[i++] = error;
      }
    }
  }
  constexpr std::ptrdiff_t kRank95 = (kNumHeldOut * 95 + 99) / 100 - 1;
  std::nth_element(errors.begin(), errors.begin() + kRank95, errors.end());
  return {static_cast<float>(sum / kNumHeldOut),
          static_cast<float>(std::sqrt(sum_of_squares / kNumHeldOut)),
          static_cast<float>(errors[kRank95]),
          static_cast<float>(*std::max_element(errors.begin() + kRank95, errors.end()))};
}

OptimizerResult<double> minimize(Problem& problem, const Parameters& start,
                                 const FitConfig& config) {
  OptimizerOptions options;
  options.max_iterations = config.max_iterations;
  return config.solver == Solver::kCeres ? minimize_ceres(problem, start, options)
                                         : minimize_tensor(problem, start, options);
}

}  // namespace

CubeFit fit_cube(const CubeSamples& samples, const FitConfig& config) {
  const FlushToZero flush_to_zero;
  Problem problem(samples.targets, 1.0 / samples.edge);
  const double threshold = config.mae_threshold * static_cast<double>(level_scale(samples.level));
  CubeFit best;
  Parameters parameters(kFitParameters, 0);
  int num_iterations = 0;
  for (const int count : samples.populated ? config.populated_steps : config.empty_steps) {
    parameters = add_gaussians(problem, parameters, count - static_cast<int>(parameters.cols()));
    OptimizerResult<double> result = minimize(problem, parameters, config);
    num_iterations += result.num_iterations;
    parameters = std::move(result.parameters);
    Gaussians gaussians = to_stored(problem, parameters, samples.edge);
    const CubeErrors errors = held_out_errors(gaussians, samples);
    if (!std::isfinite(errors.rmse)) break;
    if (!best.finite || errors.mae < best.errors.mae) {
      best = {true, std::move(gaussians), errors, 0};
    }
    if (best.errors.mae <= threshold) break;
  }
  best.num_iterations = num_iterations;
  return best;
}

}  // namespace gdfmap
