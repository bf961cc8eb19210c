#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/slice_image.hpp>

#include "drawing/arrows.hpp"
#include "drawing/canvas.hpp"
#include "drawing/contour_labels.hpp"
#include "drawing/contours.hpp"
#include "drawing/distance_scale.hpp"
#include "drawing/field_painter.hpp"
#include "drawing/layout.hpp"
#include "drawing/ticks.hpp"

namespace gdfmap {
namespace drawing {
namespace {

// In ems.
constexpr double kFrameWidth = 0.075;
constexpr double kIsoWidth = 0.07;
constexpr double kTickLength = 0.4;
constexpr double kTickGap = 0.3;
constexpr double kIsoTextSize = 0.72;

void check(const SliceImage& slice) {
  const bool has_size = slice.width > 0 && slice.height > 0 && std::isfinite(slice.resolution) &&
                        slice.resolution > 0.0;
  if (!has_size || !std::isfinite(slice.u0) || !std::isfinite(slice.v0)) {
    throw Error(ErrorCode::kUsage, "a slice needs samples and a positive resolution");
  }
  const auto count = static_cast<std::size_t>(slice.width) * static_cast<std::size_t>(slice.height);
  if (slice.distance.size() != count ||
      (!slice.is_bound.empty() && slice.is_bound.size() != count)) {
    throw Error(ErrorCode::kUsage, "a slice of " + std::to_string(slice.width) + " x " +
                                       std::to_string(slice.height) + " samples holds " +
                                       std::to_string(slice.distance.size()) + " distances and " +
                                       std::to_string(slice.is_bound.size()) + " marks");
  }
  for (const auto& gradient : {slice.gradient_u, slice.gradient_v}) {
    if (gradient.size() == (slice.gradient_u.empty() ? 0 : count)) continue;
    throw Error(ErrorCode::kUsage, "a slice needs both parts of every gradient, or none");
  }
}

/// Draws one figure, part by part.
class Figure {
 public:
  explicit Figure(const SliceImage& slice)
      : slice_(slice),
        scale_(distance_scale(slice)),
        layout_(make_layout(slice, scale_)),
        canvas_(layout_.width, layout_.height) {}

  Bytes draw() {
    paint_field(canvas_, slice_, scale_, layout_);
    draw_iso_lines();
    draw_gradients(canvas_, slice_, scale_, layout_);
    draw_axes();
    draw_color_bar();
    draw_legend();
    draw_title();
    return canvas_.png();
  }

 private:
  [[nodiscard]] double em(double count) const { return count * layout_.font; }
  [[nodiscard]] Stroke frame() const { return {kBlack, em(kFrameWidth), 1.0}; }
  [[nodiscard]] TextStyle style(Align align) const { return {layout_.font, kBlack, align, 0.0}; }

  [[nodiscard]] Stroke iso_stroke(double level) const {
    const bool on_dark = is_dark(scale_.color(level));
    return {on_dark ? kWhite : kBlack, em(kIsoWidth), on_dark ? 0.8 : 0.65};
  }

  /// Distances where iso-lines may run: bounds are no estimate.
  [[nodiscard]] std::vector<float> iso_values() const {
    std::vector<float> values = slice_.distance;
    for (std::size_t i = 0; i < slice_.is_bound.size(); ++i) {
      if (slice_.is_bound[i] != 0) values[i] = std::numeric_limits<float>::quiet_NaN();
    }
    return values;
  }

  [[nodiscard]] Point to_pixel(const Point& sample) const {
    const double s = layout_.pixels_per_sample;
    return {layout_.plot.x + (sample.x + 0.5) * s, layout_.plot.bottom() - (sample.y + 0.5) * s};
  }

  [[nodiscard]] std::vector<LabelledLine> iso_lines() const {
    const std::vector<float> values = iso_values();
    const Grid grid{values, slice_.width, slice_.height};
    std::vector<LabelledLine> lines;
    for (const double level : scale_.iso_levels()) {
      for (const Polyline& contour : contours(grid, level)) {
        LabelledLine line;
        line.level = level;
        line.text = label_of(level, scale_.iso_step);
        for (const Point& p : contour) line.points.push_back(to_pixel(p));
        lines.push_back(std::move(line));
      }
    }
    return lines;
  }

  void draw_iso_lines() {
    std::vector<LabelledLine> lines = iso_lines();
    // The legend says what a single line stands for.
    if (scale_.iso_levels().size() > 1) place_labels(lines, layout_.plot, em(kIsoTextSize));
    for (const LabelledLine& line : lines) {
      const Stroke stroke = iso_stroke(line.level);
      for (const Polyline& piece : pieces(line)) canvas_.stroke_line(piece, stroke);
      if (!line.has_label) continue;
      canvas_.text(line.text, line.label_centre,
                   {em(kIsoTextSize), stroke.color, Align::kCentre, line.label_angle});
    }
  }

  void draw_axes() {
    const Rectangle& plot = layout_.plot;
    canvas_.stroke_rectangle(plot, frame());
    for (const double tick : layout_.u.ticks) {
      const double x = layout_.x_of(tick), y = plot.bottom();
      canvas_.stroke_line(std::array{Point{x, y}, Point{x, y + em(kTickLength)}}, frame());
      canvas_.text(label_of(tick, layout_.u.step), {x, y + em(kTickLength + kTickGap + 0.5)},
                   style(Align::kCentre));
    }
    for (const double tick : layout_.v.ticks) {
      const double x = plot.x, y = layout_.y_of(tick);
      canvas_.stroke_line(std::array{Point{x - em(kTickLength), y}, Point{x, y}}, frame());
      canvas_.text(label_of(tick, layout_.v.step), {x - em(kTickLength + kTickGap), y},
                   style(Align::kEnd));
    }
    canvas_.text(slice_.u_axis + " [m]", {plot.x + 0.5 * plot.width, layout_.u_label_y},
                 style(Align::kCentre));
    draw_upright(slice_.v_axis + " [m]", {layout_.v_label_x, plot.y + 0.5 * plot.height});
  }

  void draw_upright(const std::string& text, const Point& centre) {
    TextStyle upright = style(Align::kCentre);
    upright.angle = -0.5 * std::numbers::pi;
    canvas_.text(text, centre, upright);
  }

  void draw_color_bar() {
    const Rectangle& bar = layout_.bar;
    const auto height = static_cast<int>(bar.height);
    canvas_.fill_pixels(static_cast<int>(bar.x), static_cast<int>(bar.y),
                        static_cast<int>(bar.width), height,
                        [&](int, int y) { return color_at(1.0 - (y + 0.5) / height); });
    canvas_.stroke_rectangle({std::floor(bar.x), bar.y, std::floor(bar.width), double(height)},
                             frame());
    draw_bar_tick(0.0, label_of(0.0, scale_.tick_step));
    for (const double tick : scale_.ticks()) draw_bar_tick(tick, label_of(tick, scale_.tick_step));
    draw_bar_tick(scale_.end,
                  (scale_.exceeds_end ? "\u2265 " : "") + label_of(scale_.end, scale_.tick_step));
    draw_upright(kBarLabel, {layout_.bar_label_x, bar.y + 0.5 * bar.height});
  }

  void draw_bar_tick(double distance, const std::string& label) {
    const Rectangle& bar = layout_.bar;
    const double x = std::floor(bar.x) + std::floor(bar.width);
    const double y = bar.bottom() - distance / scale_.end * bar.height;
    canvas_.stroke_line(std::array{Point{x, y}, Point{x + em(kTickLength), y}}, frame());
    canvas_.text(label, {x + em(kTickLength + kTickGap), y}, style(Align::kStart));
  }

  void draw_legend() {
    for (const LegendEntry& entry : layout_.legend) {
      const Rectangle swatch{std::floor(entry.place.x), std::floor(entry.place.y - em(0.5)),
                             std::floor(em(kSwatchWidth)), std::floor(em(1.0))};
      draw_swatch(entry.kind, swatch);
      canvas_.text(entry.text, {entry.place.x + em(kSwatchWidth + 0.5), entry.place.y},
                   style(Align::kStart));
    }
  }

  void draw_swatch(LegendKind kind, const Rectangle& swatch) {
    const double middle = swatch.y + 0.5 * swatch.height;
    const std::array line = {Point{swatch.x, middle}, Point{swatch.right(), middle}};
    const double period = hatch_period(layout_.font);
    switch (kind) {
      case LegendKind::kSurface:
        canvas_.stroke_line(line, {kBlack, em(0.25), 1.0});
        return;
      case LegendKind::kIsoLine:
        canvas_.stroke_line(line, {kBlack, em(kIsoWidth), 0.8});
        return;
      case LegendKind::kArrow:
        draw_arrow(canvas_, {swatch.x, middle}, {swatch.right(), middle}, kBlack);
        return;
      case LegendKind::kUnknown:
        fill(swatch, [&](int x, int y) { return unknown_color(x, y, period); });
        return;
      case LegendKind::kBound:
        fill(swatch,
             [&](int x, int y) { return bound_color(color_at(x / swatch.width), x, y, period); });
        return;
    }
  }

  void fill(const Rectangle& swatch, const std::function<Color(int, int)>& color) {
    canvas_.fill_pixels(static_cast<int>(swatch.x), static_cast<int>(swatch.y),
                        static_cast<int>(swatch.width), static_cast<int>(swatch.height), color);
    canvas_.stroke_rectangle(swatch, {kBlack, 0.5 * em(kFrameWidth), 1.0});
  }

  void draw_title() {
    const double width = text_width(slice_.title, layout_.title_size);
    TextStyle title = style(Align::kCentre);
    title.size =
        layout_.title_size * std::min(1.0, (layout_.width - em(1.0)) / std::max(width, 1.0));
    // Over the plot, but within the picture.
    const double half = 0.5 * std::min(width, layout_.width - em(1.0));
    const double x = std::clamp(layout_.plot.x + 0.5 * layout_.plot.width, half + em(0.5),
                                std::max(layout_.width - half - em(0.5), half + em(0.5)));
    canvas_.text(slice_.title, {x, 0.55 * layout_.plot.y}, title);
  }

  const SliceImage& slice_;
  DistanceScale scale_;
  FigureLayout layout_;
  Canvas canvas_;
};

}  // namespace
}  // namespace drawing

void draw_slice(const SliceImage& slice, const std::filesystem::path& png) {
  drawing::check(slice);
  const Bytes bytes = drawing::Figure(slice).draw();
  AtomicFile file(png);
  file.write(bytes);
  file.commit();
}

}  // namespace gdfmap
