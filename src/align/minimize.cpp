#include <gdfmap/align/minimize.hpp>

namespace gdfmap {
namespace {

bool is_small(const Twist& step, const MinimizeOptions& options) {
  return step.head<3>().norm() < options.translation_tolerance &&
         step.tail<3>().norm() < options.rotation_tolerance;
}

}  // namespace

Minimum minimize(Factor& factor, StepRule& rule, const Eigen::Isometry3d& T,
                 const MinimizeOptions& options) {
  Minimum minimum;
  minimum.T = T;
  while (minimum.iterations < options.max_iterations) {
    const RobustKernel kernel = options.kernel.at(minimum.iterations);
    factor.match(minimum.T);
    if (factor.num_matched() == 0) return minimum;
    const Linearization model = factor.linearize(minimum.T, kernel);
    const StepRule::Trial trial{
        [&](const Twist& step) { return factor.cost(factor.retract(minimum.T, step), kernel); },
        [&](const Twist& step) {
          return factor.linearize(factor.retract(minimum.T, step), kernel);
        }};
    const Twist step = rule.step(model, trial);
    if (!step.allFinite()) return minimum;
    minimum.T = factor.retract(minimum.T, step);
    const bool is_final = options.kernel.is_final(minimum.iterations);
    ++minimum.iterations;
    if (is_final && is_small(step, options)) {
      minimum.converged = true;
      return minimum;
    }
  }
  return minimum;
}

}  // namespace gdfmap
