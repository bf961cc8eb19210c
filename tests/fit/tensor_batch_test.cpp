#include <cmath>

#include <gtest/gtest.h>

#include <gdfmap/fit/optimizers.hpp>
#include <gdfmap/fit/tensor_batch.hpp>

#include "support/cube_targets.hpp"

namespace gdfmap {
namespace {

using Parameters = FitParameters<double>;

/// Parameters spread over cube and margin, all different.
Parameters example_parameters(Eigen::Index count) {
  Parameters parameters(kFitParameters, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto t = static_cast<double>(k);
    parameters.col(k) << 0.4 * std::sin(3.0 * t + 1.0), 0.5 + 0.7 * std::sin(t),
        0.5 + 0.6 * std::cos(t), 0.3 + 0.1 * std::sin(2.0 * t), std::log(0.3 + 0.2 * std::sin(t)),
        std::log(0.5), std::log(0.6 + 0.3 * std::cos(t));
  }
  return parameters;
}

/// The reference at given parameters, with its normal equations.
TensorBatch<double> batch_at(const CubeProblem& problem, const Parameters& parameters) {
  TensorBatch<double> batch(problem.grid, static_cast<int>(parameters.cols()));
  batch.set_problems({{{0, problem}}});
  batch.set_candidate(0, parameters);
  batch.evaluate();
  batch.accept({true});
  return batch;
}

TEST(AxisWeights, AreOneInsideAndFallInTheMarginToAFloor) {
  for (const TrainingGrid& grid : kTrainingGrids) {
    const std::vector<double> w = axis_weights(grid);
    ASSERT_EQ(w.size(), static_cast<std::size_t>(grid.per_axis()));
    EXPECT_LT(w.front(), 0.2);
    for (int i = 0; i < grid.per_edge; ++i) {
      EXPECT_EQ(w[static_cast<std::size_t>(grid.margin + i)], 1.0);
    }
    for (std::size_t i = 0; i < w.size(); ++i) EXPECT_EQ(w[i], w[w.size() - 1 - i]);
  }
  EXPECT_EQ(axis_weights(kEmptyGrid)[0], 0.15);
  EXPECT_NEAR(axis_weights(kEmptyGrid)[1], 0.31640625, 1e-12);  // smoothstep(3/8)
}

TEST(TensorBatch, CostIsHalfTheSquaredResidualsOfCeres) {
  const test::CubeTargets targets(test::planes_distance(3));
  const Parameters parameters = example_parameters(6);
  const auto batch = batch_at(targets.problem(), parameters);
  const DenseEvaluation dense = evaluate_with_ceres(targets.problem(), parameters);
  EXPECT_NEAR(batch.cost(0), 0.5 * dense.residuals.squaredNorm(), 1e-12 * batch.cost(0));
}

TEST(TensorBatch, NormalEquationsEqualThoseOfCeresJacobian) {
  for (const Eigen::Index count : {1, 2, 8, 16, 32}) {
    const test::CubeTargets targets(test::planes_distance(2), count > 2);
    const Parameters parameters = example_parameters(count);
    const auto batch = batch_at(targets.problem(), parameters);
    const DenseEvaluation dense = evaluate_with_ceres(targets.problem(), parameters);
    const Eigen::MatrixXd expected = dense.jacobian.transpose() * dense.jacobian;
    const Eigen::VectorXd expected_gradient = dense.jacobian.transpose() * dense.residuals;
    EXPECT_LE((batch.normal_matrix(0) - expected).cwiseAbs().maxCoeff(),
              1e-9 * expected.cwiseAbs().maxCoeff());
    EXPECT_LE((batch.gradient(0) - expected_gradient).cwiseAbs().maxCoeff(),
              1e-9 * expected_gradient.cwiseAbs().maxCoeff());
  }
}

TEST(TensorBatch, GradientEqualsCentralDifferencesOfTheCost) {
  const test::CubeTargets targets(test::planes_distance(5));
  const CubeProblem problem = targets.problem();
  const Parameters parameters = example_parameters(4);
  const Eigen::VectorXd gradient = batch_at(problem, parameters).gradient(0);
  const double h = 1e-6;
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    Parameters moved = parameters;
    moved.data()[i] = parameters.data()[i] + h;
    const double above = batch_at(problem, moved).cost(0);
    moved.data()[i] = parameters.data()[i] - h;
    const double below = batch_at(problem, moved).cost(0);
    EXPECT_NEAR(gradient[i], (above - below) / (2 * h), 1e-5 * gradient.cwiseAbs().maxCoeff());
  }
}

TEST(TensorBatch, StepSolvesTheDampedEquations) {
  const test::CubeTargets targets(test::planes_distance(9));
  // Seven Gaussians: the rows do not fill the last tile of the matrix.
  const Parameters parameters = example_parameters(7);
  auto batch = batch_at(targets.problem(), parameters);
  const double damping = 1e3;  // so short a step that nothing is clamped
  batch.step(std::array{damping});
  Eigen::MatrixXd damped = batch.normal_matrix(0);
  for (Eigen::Index i = 0; i < damped.rows(); ++i) {
    damped(i, i) *= 1.0 + damping;
    if (i % kFitParameters == kFitWeight) damped(i, i) += damping * 1e-6 * kPopulatedGrid.size();
  }
  const Eigen::VectorXd expected = damped.ldlt().solve(-batch.gradient(0));
  const Parameters moved = batch.candidate(0);
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    EXPECT_NEAR(moved.data()[i] - parameters.data()[i], expected[i],
                1e-5 * expected.cwiseAbs().maxCoeff());
  }
}

TEST(TensorBatch, PredictedDecreaseIsThatOfTheQuadraticModel) {
  const test::CubeTargets targets(test::planes_distance(4));
  const Parameters parameters = example_parameters(5);
  auto batch = batch_at(targets.problem(), parameters);
  batch.step(std::array{1.0});
  const Parameters moved = batch.candidate(0);
  const Parameters difference = moved - parameters;
  const Eigen::Map<const Eigen::VectorXd> step(difference.data(), difference.size());
  const double expected =
      -step.dot(batch.gradient(0)) - 0.5 * step.dot(batch.normal_matrix(0) * step);
  EXPECT_NEAR(batch.predicted_decrease(0), expected, 1e-12 * std::abs(expected));
}

TEST(TensorBatch, SolvedWeightsLeaveNoGradientInThem) {
  const test::CubeTargets targets(test::planes_distance(7));
  const CubeProblem problem = targets.problem();
  auto batch = batch_at(problem, example_parameters(5));
  batch.solve_weights(0.0);
  const auto solved = batch_at(problem, batch.candidate(0));
  for (Eigen::Index k = 0; k < 5; ++k) {
    EXPECT_NEAR(solved.gradient(0)[kFitParameters * k], 0.0, 1e-9);
  }
}

TEST(TensorBatch, KeepsTheWeightsOfGaussiansThatAreAllTheSame) {
  const test::CubeTargets targets(test::planes_distance(7));
  TensorBatch<float> batch(kPopulatedGrid, 8);
  FitParameters<float> parameters = example_parameters(8).cast<float>();
  for (Eigen::Index k = 1; k < 8; ++k) parameters.col(k) = parameters.col(0);
  batch.set_problems({{{0, targets.problem()}}});
  batch.set_candidate(0, parameters);
  batch.evaluate();
  batch.solve_weights(-1e-3);  // surely not positive definite
  EXPECT_EQ(batch.candidate(0), parameters);
}

TEST(TensorBatch, PursuitFindsAnAtomThatIsThere) {
  const test::CubeTargets targets([](const Vector3& p) {
    const Vector3 u = (p - Vector3(0.5, 0.25, 0.75)) / 0.25;
    return 0.8 * std::exp(-0.5 * u.squaredNorm());
  });
  TensorBatch<double> batch(kPopulatedGrid, 1);
  batch.resize(0);
  batch.set_problems({{{0, targets.problem()}}});
  batch.compute_residuals();
  batch.resize(1);
  batch.pursue(0, 1);
  batch.evaluate();
  batch.solve_weights(0.0);
  const Parameters found = batch.candidate(0);
  EXPECT_NEAR(found(kFitWeight, 0), 0.8, 1e-6);
  EXPECT_NEAR(found(kFitMean, 0), 0.5, 1e-12);
  EXPECT_NEAR(found(kFitMean + 1, 0), 0.25, 1e-12);
  EXPECT_NEAR(found(kFitMean + 2, 0), 0.75, 1e-12);
  EXPECT_NEAR(std::exp(found(kFitLogSigma, 0)), 0.25, 1e-12);
}

TEST(TensorBatch, FloatAgreesWithTheReference) {
  const test::CubeTargets targets(test::planes_distance(4));
  const CubeProblem problem = targets.problem();
  const Parameters parameters = example_parameters(8);
  const double cost = batch_at(problem, parameters).cost(0);
  TensorBatch<float> batch(kPopulatedGrid, 8);
  const int lane = batch.num_lanes() - 1;
  batch.set_problems({{{lane, problem}}});
  batch.set_candidate(lane, parameters.cast<float>());
  batch.evaluate();
  EXPECT_NEAR(batch.cost(lane), cost, 1e-5 * cost);
}

TEST(TensorBatch, RefusesMoreGaussiansThanItHasRoomFor) {
  TensorBatch<float> batch(kPopulatedGrid, 8);
  EXPECT_THROW(batch.resize(9), std::exception);
}

}  // namespace
}  // namespace gdfmap
