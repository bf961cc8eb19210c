#pragma once

#include <span>
#include <vector>

#include "canvas.hpp"

namespace gdfmap::drawing {

/// Values on a grid, row by row; not-a-number where no line may run.
struct Grid {
  std::span<const float> values;
  int width = 0, height = 0;

  [[nodiscard]] float at(int i, int j) const {
    return values[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(i)];
  }
};

/// A line in grid coordinates; closed ones repeat their first point.
using Polyline = std::vector<Point>;

/// The lines on which the linearly interpolated grid takes the value `level` (marching squares), in
/// an order that depends on the grid alone.
[[nodiscard]] std::vector<Polyline> contours(const Grid& grid, double level);

}  // namespace gdfmap::drawing
