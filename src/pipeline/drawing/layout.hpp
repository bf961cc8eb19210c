#pragma once

#include <string>
#include <vector>

#include <gdfmap/pipeline/slice_image.hpp>

#include "canvas.hpp"
#include "distance_scale.hpp"

namespace gdfmap::drawing {

/// What a legend explains: a swatch or a line, and its text.
enum class LegendKind { kSurface, kIsoLine, kArrow, kUnknown, kBound };
struct LegendEntry {
  LegendKind kind;
  std::string text;
  Point place;  ///< left end, middle of the line
};

/// One axis of the plot: metres at its two ends and the ticks between them.
struct AxisLayout {
  double low = 0.0, high = 0.0;
  double step = 1.0;
  std::vector<double> ticks;
};

/// Where everything of the figure goes, pixels. The plot starts and ends on whole pixels.
struct FigureLayout {
  int width = 0, height = 0;
  int pixels_per_sample = 1;
  double font = 14.0;
  Rectangle plot;
  Rectangle bar;  ///< colour scale
  AxisLayout u, v;
  double u_label_y = 0.0, v_label_x = 0.0, bar_label_x = 0.0;
  double title_size = 16.0;
  std::vector<LegendEntry> legend;

  [[nodiscard]] double x_of(double u_metres) const {
    return plot.x + (u_metres - u.low) / (u.high - u.low) * plot.width;
  }
  [[nodiscard]] double y_of(double v_metres) const {
    return plot.bottom() - (v_metres - v.low) / (v.high - v.low) * plot.height;
  }
};

inline constexpr const char* kBarLabel = "distance to the nearest point [m]";
/// Share of the legend's line that swatches take, in ems.
inline constexpr double kSwatchWidth = 1.8;

/// @throws Error kUsage when the figure would exceed kMaxPictureSide.
[[nodiscard]] FigureLayout make_layout(const SliceImage& slice, const DistanceScale& scale);

}  // namespace gdfmap::drawing
