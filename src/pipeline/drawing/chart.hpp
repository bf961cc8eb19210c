#pragma once

#include <span>
#include <string>
#include <vector>

#include "canvas.hpp"

namespace gdfmap::drawing {

/// One axis of a chart, in the units of its label.
struct ChartAxis {
  std::string label;
  double low = 0.0, high = 1.0;
  bool is_logarithmic = false;

  /// 0 at the low end, 1 at the high one; values beyond are clamped.
  [[nodiscard]] double share(double value) const;
  /// Where numbers stand: decades, or multiples of a round step.
  [[nodiscard]] std::vector<double> ticks() const;
  [[nodiscard]] std::string label_of_tick(double value) const;
};

/// The least logarithmic axis over whole decades that shows all of these positive values.
[[nodiscard]] ChartAxis decades_around(const std::string& label, std::span<const double> values);

/// What a line of a chart stands for.
struct ChartEntry {
  std::string text;
  Stroke stroke;
};

/// Draws data into a rectangle of a canvas.
class Chart {
 public:
  /// @param font  em, pixels
  Chart(Canvas& canvas, const Rectangle& plot, double font, ChartAxis x, ChartAxis y);

  /// Pixels of a place in the units of the axes.
  [[nodiscard]] Point place(const Point& data) const;

  /// Lines at the ticks, to be drawn first.
  void draw_grid();
  void draw_line(std::span<const Point> data, const Stroke& stroke);
  /// What lies between a line and the lower end of the y axis.
  void draw_area(std::span<const Point> data, const Color& color);
  /// Frame, ticks, numbers and labels, to be drawn last; the title stands above.
  void draw_axes(const std::string& title);
  /// In one line above the plot, below the title.
  void draw_legend(std::span<const ChartEntry> entries);

 private:
  [[nodiscard]] double em(double count) const { return count * font_; }

  Canvas& canvas_;
  Rectangle plot_;
  double font_;
  ChartAxis x_, y_;
};

}  // namespace gdfmap::drawing
