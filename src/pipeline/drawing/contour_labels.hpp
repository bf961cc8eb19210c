#pragma once

#include <string>
#include <vector>

#include "canvas.hpp"
#include "contours.hpp"

namespace gdfmap::drawing {

/// An iso-line in pixels with the stretches that its labels leave free.
struct LabelledLine {
  Polyline points;
  std::string text;
  double level = 0.0;
  bool has_label = false;
  double gap_begin = 0.0, gap_end = 0.0;  ///< along the line, pixels
  Point label_centre;
  double label_angle = 0.0;  ///< radians, so that the text stands upright
};

/// Gives the longer lines a label each where they are straightest, inside `area` and apart from
/// each other. Longest lines choose first.
void place_labels(std::vector<LabelledLine>& lines, const Rectangle& area, double text_size);

/// The line without its gap, in one or two pieces.
[[nodiscard]] std::vector<Polyline> pieces(const LabelledLine& line);

}  // namespace gdfmap::drawing
