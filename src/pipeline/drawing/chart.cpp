#include "chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "ticks.hpp"

namespace gdfmap::drawing {
namespace {

constexpr Color kGridColor{0.85, 0.85, 0.85};
constexpr double kLinearTicks = 5.0;

// In ems.
constexpr double kFrameWidth = 0.075;
constexpr double kTickLength = 0.4;
constexpr double kTickGap = 0.3;
constexpr double kSwatchWidth = 2.4;
constexpr double kSwatchGap = 0.5;  // between a swatch and its text
constexpr double kLegendGap = 1.6;  // between entries

}  // namespace

double ChartAxis::share(double value) const {
  const double place = is_logarithmic ? std::log(std::max(value, low) / low) / std::log(high / low)
                                      : (value - low) / (high - low);
  return std::clamp(place, 0.0, 1.0);
}

std::vector<double> ChartAxis::ticks() const {
  if (!is_logarithmic) return multiples(low, high, round_step((high - low) / kLinearTicks));
  std::vector<double> decades;
  for (double exponent : multiples(std::log10(low), std::log10(high), 1.0)) {
    decades.push_back(std::pow(10.0, exponent));
  }
  return decades;
}

std::string ChartAxis::label_of_tick(double value) const {
  return label_of(value, is_logarithmic ? value : round_step((high - low) / kLinearTicks));
}

ChartAxis decades_around(const std::string& label, std::span<const double> values) {
  const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
  ChartAxis axis{label, 0.0, 0.0, true};
  const double first = std::floor(std::log10(*least) + 1e-9);
  axis.low = std::pow(10.0, first);
  axis.high = std::pow(10.0, std::max(first + 1.0, std::ceil(std::log10(*greatest) - 1e-9)));
  return axis;
}

Chart::Chart(Canvas& canvas, const Rectangle& plot, double font, ChartAxis x, ChartAxis y)
    : canvas_(canvas), plot_(plot), font_(font), x_(std::move(x)), y_(std::move(y)) {}

Point Chart::place(const Point& data) const {
  return {plot_.x + x_.share(data.x) * plot_.width,
          plot_.bottom() - y_.share(data.y) * plot_.height};
}

void Chart::draw_grid() {
  const Stroke stroke{kGridColor, em(kFrameWidth), 1.0};
  for (const double tick : x_.ticks()) {
    const double x = place({tick, 0.0}).x;
    canvas_.stroke_line(std::array{Point{x, plot_.y}, Point{x, plot_.bottom()}}, stroke);
  }
  for (const double tick : y_.ticks()) {
    const double y = place({0.0, tick}).y;
    canvas_.stroke_line(std::array{Point{plot_.x, y}, Point{plot_.right(), y}}, stroke);
  }
}

void Chart::draw_line(std::span<const Point> data, const Stroke& stroke) {
  std::vector<Point> line;
  for (const Point& p : data) line.push_back(place(p));
  canvas_.stroke_line(line, stroke);
}

void Chart::draw_area(std::span<const Point> data, const Color& color) {
  if (data.empty()) return;
  std::vector<Point> outline;
  for (const Point& p : data) outline.push_back(place(p));
  outline.push_back({outline.back().x, plot_.bottom()});
  outline.push_back({outline.front().x, plot_.bottom()});
  canvas_.fill_polygon(outline, color);
}

void Chart::draw_axes(const std::string& title) {
  const Stroke frame{kBlack, em(kFrameWidth), 1.0};
  canvas_.stroke_rectangle(plot_, frame);
  for (const double tick : x_.ticks()) {
    const double x = place({tick, 0.0}).x, y = plot_.bottom();
    canvas_.stroke_line(std::array{Point{x, y}, Point{x, y + em(kTickLength)}}, frame);
    canvas_.text(x_.label_of_tick(tick), {x, y + em(kTickLength + kTickGap + 0.5)},
                 {font_, kBlack, Align::kCentre, 0.0});
  }
  double widest = 0.0;
  for (const double tick : y_.ticks()) {
    const double x = plot_.x, y = place({0.0, tick}).y;
    const std::string label = y_.label_of_tick(tick);
    canvas_.stroke_line(std::array{Point{x - em(kTickLength), y}, Point{x, y}}, frame);
    canvas_.text(label, {x - em(kTickLength + kTickGap), y}, {font_, kBlack, Align::kEnd, 0.0});
    widest = std::max(widest, text_width(label, font_));
  }
  canvas_.text(x_.label, {plot_.x + 0.5 * plot_.width, plot_.bottom() + em(2.7)},
               {font_, kBlack, Align::kCentre, 0.0});
  canvas_.text(y_.label,
               {plot_.x - em(kTickLength + kTickGap + 0.9) - widest, plot_.y + 0.5 * plot_.height},
               {font_, kBlack, Align::kCentre, -0.5 * std::numbers::pi});
  canvas_.text(title, {plot_.x + 0.5 * plot_.width, plot_.y - em(2.6)},
               {font_, kBlack, Align::kCentre, 0.0});
}

void Chart::draw_legend(std::span<const ChartEntry> entries) {
  double width = -em(kLegendGap);
  for (const ChartEntry& entry : entries) {
    width += em(kSwatchWidth + kSwatchGap + kLegendGap) + text_width(entry.text, font_);
  }
  double x = plot_.x + 0.5 * (plot_.width - width);
  const double y = plot_.y - em(1.0);
  for (const ChartEntry& entry : entries) {
    canvas_.stroke_line(std::array{Point{x, y}, Point{x + em(kSwatchWidth), y}}, entry.stroke);
    x += em(kSwatchWidth + kSwatchGap);
    canvas_.text(entry.text, {x, y}, {font_, kBlack, Align::kStart, 0.0});
    x += text_width(entry.text, font_) + em(kLegendGap);
  }
}

}  // namespace gdfmap::drawing
