#pragma once

#include <gdfmap/fit/tensor_problem.hpp>

namespace gdfmap {

/// Adds `count` Gaussians where the model misses most: batch orthogonal matching pursuit over a
/// tensor dictionary (all combinations of 1-D atoms over the axes), four atoms a round, all weights
/// solved for after every round. The old Gaussians keep their shapes. Leaves `problem` evaluated at
/// the result.
[[nodiscard]] TensorProblem<double>::Parameters add_gaussians(
    TensorProblem<double>& problem, const TensorProblem<double>::Parameters& start, int count);

}  // namespace gdfmap
