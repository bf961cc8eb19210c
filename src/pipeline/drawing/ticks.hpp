#pragma once

#include <string>
#include <vector>

namespace gdfmap::drawing {

/// The smallest of 1, 2, 2.5, 5 · 10ⁿ that is not below `at_least` (> 0).
[[nodiscard]] double round_step(double at_least);
/// The smallest round number that is not below `value` (> 0), with finer choices than round_step().
[[nodiscard]] double round_end(double value);
/// Multiples of `step` within [low, high].
[[nodiscard]] std::vector<double> multiples(double low, double high, double step);
/// With as many decimals as multiples of `step` need, and a true minus sign.
[[nodiscard]] std::string label_of(double value, double step);

}  // namespace gdfmap::drawing
