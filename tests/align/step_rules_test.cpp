#include <cmath>

#include <gtest/gtest.h>

#include <gdfmap/align/minimize.hpp>
#include <gdfmap/align/surface_factor.hpp>

#include "align_fixtures.hpp"

namespace gdfmap {
namespace {

struct Scene {
  Eigen::Isometry3d T_true = exp_twist((Twist() << 0.2, -0.1, 0.05, 0.01, 0.02, -0.03).finished());
  SurfaceCloud target{test::corner_points(20'000, 6.0, 0.0, 1), 0.2, 1};
  SurfaceCloud source{test::moved(T_true.inverse(), test::corner_points(15'000, 6.0, 0.0, 2)), 0.2,
                      1};
};

Minimum minimize_with(StepRule& rule, const Scene& scene, int max_iterations = 60) {
  SurfaceFactor factor(scene.target, scene.source, {SurfaceResidual::kPlane, 1.0, 1});
  MinimizeOptions options;
  options.max_iterations = max_iterations;
  options.kernel = {KernelKind::kCauchy, 0.2, 0.2};
  return minimize(factor, rule, Eigen::Isometry3d::Identity(), options);
}

double error_of(const Minimum& minimum, const Scene& scene) {
  return log_motion(minimum.T * scene.T_true.inverse()).norm();
}

TEST(StepRules, AllFindTheSameMinimum) {
  const Scene scene;
  for (const auto& rule :
       {make_gauss_newton(), make_levenberg_marquardt(), make_grad_lm(), make_newton()}) {
    const Minimum minimum = minimize_with(*rule, scene);
    EXPECT_TRUE(minimum.converged);
    EXPECT_LT(error_of(minimum, scene), 2e-3);
  }
}

/// The gates as gradSLAM's documentation and code have them: what is taken of a step falls with the
/// gain instead of rising.
class DocumentedGradLm final : public StepRule {
 public:
  explicit DocumentedGradLm(double nu) { options_.nu = nu; }
  Twist step(const Linearization& model, const Trial& trial) override {
    const Twist whole = damped_step(model, options_.damp);
    const double change = grad_lm_change(model.cost, trial.cost(whole));
    return grad_lm_gain(-change, options_) * whole;
  }

 private:
  GradLmOptions options_;
};

TEST(GradLm, StallsAsDocumentedAndDoesNotAsCorrected) {
  const Scene scene;
  DocumentedGradLm documented(1.0);
  const double start = error_of(minimize_with(documented, scene, 0), scene);
  EXPECT_GT(error_of(minimize_with(documented, scene, 20), scene), 0.9 * start);

  GradLmOptions options;
  options.nu = 1.0;
  EXPECT_LT(error_of(minimize_with(*make_grad_lm(options), scene, 20), scene), 0.05 * start);
}

TEST(GradLm, GatesAreNeutralWhereTheCostStaysAndOpenWhereItFalls) {
  GradLmOptions options;
  EXPECT_DOUBLE_EQ(grad_lm_damping_factor(0.0, options), 1.0);
  EXPECT_LT(grad_lm_damping_factor(-20.0, options), 0.51);
  EXPECT_GT(grad_lm_damping_factor(20.0, options), 1.99);
  options.nu = 1.0;
  EXPECT_GT(grad_lm_gain(-20.0, options), 0.999);
  EXPECT_LT(grad_lm_gain(20.0, options), 0.001);
  EXPECT_EQ(grad_lm_change(1.0, 1e9), 70.0);
  EXPECT_EQ(grad_lm_change(1.0, 0.0), -20.0);
}

TEST(LevenbergMarquardt, NeverTakesAStepUphill) {
  const Linearization model{Matrix6::Identity(), Twist::Ones(), 1.0};
  const StepRule::Trial uphill{[](const Twist& step) { return 1.0 + step.norm(); }, {}};
  EXPECT_EQ(make_levenberg_marquardt()->step(model, uphill), Twist::Zero());
}

/// Rosenbrock's valley in the first two coordinates, a bowl in the others.
struct Valley {
  static Linearization at(const Twist& x) {
    Linearization model;
    const double a = 1.0 - x[0], b = x[1] - x[0] * x[0];
    model.cost = a * a + 100.0 * b * b + x.tail<4>().squaredNorm();
    model.gradient << -2.0 * a - 400.0 * x[0] * b, 200.0 * b, 2.0 * x.tail<4>();
    model.hessian = 2.0 * Matrix6::Identity();
    model.hessian(0, 0) = 2.0 - 400.0 * (b - 2.0 * x[0] * x[0]);
    model.hessian(0, 1) = model.hessian(1, 0) = -400.0 * x[0];
    model.hessian(1, 1) = 200.0;
    return model;
  }
};

TEST(Newton, DescendsAlongACurvedValley) {
  Twist x;
  x << -1.2, 1.0, 0.3, -0.4, 0.5, 2.0;
  const auto rule = make_newton();
  for (int i = 0; i < 60; ++i) {
    const Linearization model = Valley::at(x);
    const Twist step = rule->step(model, {[&](const Twist& s) { return Valley::at(x + s).cost; },
                                          [&](const Twist& s) { return Valley::at(x + s); }});
    ASSERT_LE(Valley::at(x + step).cost, model.cost);
    x += step;
  }
  Twist expected = Twist::Zero();
  expected[0] = expected[1] = 1.0;
  EXPECT_LT((x - expected).norm(), 1e-6);
}

TEST(DampedStep, LeavesDirectionsAloneThatNothingIsKnownOf) {
  Linearization model;
  model.hessian(2, 2) = 2.0;
  model.gradient[2] = 1.0;
  const Twist step = damped_step(model, 0.0);
  EXPECT_NEAR(step[2], -0.5, 1e-9);
  EXPECT_NEAR(step.norm(), 0.5, 1e-9);
}

}  // namespace
}  // namespace gdfmap
