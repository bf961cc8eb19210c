#include <cmath>

#include <gtest/gtest.h>

#include <gdfmap/fit/optimizers.hpp>
#include <gdfmap/fit/tensor_problem.hpp>

#include "support/cube_targets.hpp"

namespace gdfmap {
namespace {

using Problem = TensorProblem<double>;

/// Parameters spread over cube and margin, all different.
Problem::Parameters example_parameters(Eigen::Index count) {
  Problem::Parameters parameters(kFitParameters, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto t = static_cast<double>(k);
    parameters.col(k) << 0.4 * std::sin(3.0 * t + 1.0), 0.5 + 0.7 * std::sin(t),
        0.5 + 0.6 * std::cos(t), 0.3 + 0.1 * std::sin(2.0 * t), std::log(0.3 + 0.2 * std::sin(t)),
        std::log(0.5), std::log(0.6 + 0.3 * std::cos(t));
  }
  return parameters;
}

TEST(AxisWeights, AreOneInsideAndFallInTheMarginToAFloor) {
  const auto& w = axis_weights();
  for (int i = kMarginSamples; i < kSamplesPerAxis - kMarginSamples; ++i) {
    EXPECT_EQ(w[static_cast<std::size_t>(i)], 1.0);
  }
  EXPECT_EQ(w[0], 0.15);
  EXPECT_NEAR(w[1], 0.31640625, 1e-12);  // smoothstep(3/8)
  EXPECT_EQ(w[0], w[kSamplesPerAxis - 1]);
  EXPECT_EQ(w[1], w[kSamplesPerAxis - 2]);
}

TEST(TensorProblem, CostIsHalfTheSquaredResidualsOfCeres) {
  const test::CubeTargets targets(test::planes_distance(3));
  Problem problem(targets.targets, 1.0);
  const auto parameters = example_parameters(6);
  const double cost = problem.evaluate(parameters);
  const DenseEvaluation dense = evaluate_with_ceres(problem, parameters);
  EXPECT_NEAR(cost, 0.5 * dense.residuals.squaredNorm(), 1e-12 * cost);
}

TEST(TensorProblem, NormalEquationsEqualThoseOfCeresJacobian) {
  const test::CubeTargets targets(test::planes_distance(2));
  for (const Eigen::Index count : {1, 2, 8, 16, 32}) {
    Problem problem(targets.targets, 1.0);
    const auto parameters = example_parameters(count);
    problem.evaluate(parameters);
    Problem::Matrix normal_matrix;
    Problem::Vector gradient;
    problem.normal_equations(normal_matrix, gradient);
    const DenseEvaluation dense = evaluate_with_ceres(problem, parameters);
    const Eigen::MatrixXd expected = dense.jacobian.transpose() * dense.jacobian;
    const Eigen::VectorXd expected_gradient = dense.jacobian.transpose() * dense.residuals;
    EXPECT_LE((normal_matrix - expected).cwiseAbs().maxCoeff(),
              1e-9 * expected.cwiseAbs().maxCoeff());
    EXPECT_LE((gradient - expected_gradient).cwiseAbs().maxCoeff(),
              1e-9 * expected_gradient.cwiseAbs().maxCoeff());
  }
}

TEST(TensorProblem, GradientEqualsCentralDifferencesOfTheCost) {
  const test::CubeTargets targets(test::planes_distance(5));
  Problem problem(targets.targets, 1.0);
  auto parameters = example_parameters(4);
  problem.evaluate(parameters);
  Problem::Matrix normal_matrix;
  Problem::Vector gradient;
  problem.normal_equations(normal_matrix, gradient);
  const double h = 1e-6;
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    double& value = parameters.data()[i];
    const double saved = value;
    value = saved + h;
    const double above = problem.evaluate(parameters);
    value = saved - h;
    const double below = problem.evaluate(parameters);
    value = saved;
    EXPECT_NEAR(gradient[i], (above - below) / (2 * h), 1e-5 * gradient.cwiseAbs().maxCoeff());
  }
}

TEST(TensorProblem, SolvedWeightsLeaveNoGradientInThem) {
  const test::CubeTargets targets(test::planes_distance(7));
  Problem problem(targets.targets, 1.0);
  auto parameters = example_parameters(5);
  problem.evaluate(parameters);
  parameters.row(kFitWeight) = problem.solve_weights(0.0).transpose();
  problem.evaluate(parameters);
  Problem::Matrix normal_matrix;
  Problem::Vector gradient;
  problem.normal_equations(normal_matrix, gradient);
  for (Eigen::Index k = 0; k < 5; ++k) EXPECT_NEAR(gradient[kFitParameters * k], 0.0, 1e-9);
}

TEST(TensorProblem, FloatAgreesWithDouble) {
  const test::CubeTargets targets(test::planes_distance(4));
  Problem exact(targets.targets, 1.0);
  TensorProblem<float> rounded(targets.targets, 1.0);
  const auto parameters = example_parameters(8);
  const double cost = exact.evaluate(parameters);
  EXPECT_NEAR(rounded.evaluate(parameters.cast<float>()), cost, 1e-4 * cost);
}

}  // namespace
}  // namespace gdfmap
