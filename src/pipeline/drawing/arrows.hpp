#pragma once

#include <gdfmap/pipeline/slice_image.hpp>

#include "canvas.hpp"
#include "distance_scale.hpp"
#include "layout.hpp"

namespace gdfmap::drawing {

/// An arrow with a filled head; nothing when it is shorter than two pixels.
void draw_arrow(Canvas& canvas, const Point& from, const Point& to, const Color& color);

/// Arrows along the gradient at regular places of the plot, where it is known: as long as the
/// legend's for a slope of 1, white on dark colours.
void draw_gradients(Canvas& canvas, const SliceImage& slice, const DistanceScale& scale,
                    const FigureLayout& layout);

}  // namespace gdfmap::drawing
