#pragma once

#include <vector>

#include <gdfmap/pipeline/slice_image.hpp>

#include "color_map.hpp"

namespace gdfmap::drawing {

/// What the distances of a slice are drawn with, metres.
struct DistanceScale {
  double end = 1.0;         ///< of the colours, a round number; they start at 0
  double tick_step = 0.25;  ///< between numbers on the colour bar
  double iso_step =
      0.25;              ///< between iso-lines: not below tick_step, nor too dense for the picture
  double surface = 0.0;  ///< below this distance the surface is drawn
  bool exceeds_end = false;  ///< lower bounds may lie beyond the end
  bool has_surface = false, has_unknown = false, has_bound = false;

  [[nodiscard]] Color color(double distance) const { return color_at(distance / end); }
  /// Multiples of the steps within the colours, without 0 and the end; there may be no iso-line.
  [[nodiscard]] std::vector<double> ticks() const;
  [[nodiscard]] std::vector<double> iso_levels() const;
};

[[nodiscard]] DistanceScale distance_scale(const SliceImage& slice);

}  // namespace gdfmap::drawing
