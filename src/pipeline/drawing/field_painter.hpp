#pragma once

#include "canvas.hpp"
#include "distance_scale.hpp"
#include "layout.hpp"

namespace gdfmap::drawing {

/// 1 on stripes a quarter of the period wide, 0 between, blended over a pixel. All in pixels.
[[nodiscard]] double stripe(double place, double period);

/// What stands for unknown samples and lower bounds: stripes by the place of a pixel. `period` is
/// that of the stripes, pixels.
[[nodiscard]] Color unknown_color(int x, int y, double period);
[[nodiscard]] Color bound_color(const Color& color, int x, int y, double period);
[[nodiscard]] double hatch_period(double font);

/// Fills the plot's pixels. Between samples distances are interpolated; status is that of the
/// nearest.
void paint_field(Canvas& canvas, const SliceImage& slice, const DistanceScale& scale,
                 const FigureLayout& layout);

}  // namespace gdfmap::drawing
