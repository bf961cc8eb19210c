#pragma once

#include <functional>

namespace gdfmap {

/// Value and slope of a function at a place on a line.
struct LineValue {
  double value = 0.0, slope = 0.0;
};

/// A step length that meets the strong Wolfe conditions, by the algorithm of Moré and Thuente,
/// "Line search algorithms with guaranteed sufficient decrease", ACM TOMS 20 (1994), 286–307. The
/// first trial is 1, the longest step 4. Where ten trials do not do, the best of them; 0 where none
/// was lower than the start.
/// @param start  at step 0, slope negative
/// @param at     value and slope at a step
[[nodiscard]] double line_search(const LineValue& start,
                                 const std::function<LineValue(double)>& at);

}  // namespace gdfmap
