#include "layout.hpp"

#include <algorithm>
#include <cmath>

#include <gdfmap/core/error.hpp>

#include "ticks.hpp"

namespace gdfmap::drawing {
namespace {

constexpr double kPlotSide = 800.0;  // pixels that the longer side of a small slice is enlarged to
constexpr double kFontShare = 0.021;
constexpr double kMinFont = 13.0;

// In ems.
constexpr double kPadding = 0.9;
constexpr double kTickLength = 0.4;
constexpr double kTickGap = 0.3;  // between a tick and its label
constexpr double kTickSpacing = 5.5;
constexpr double kDenseTickSpacing = 2.2;  // upwards, where a flat plot has room for no more
constexpr double kBarGap = 1.6;
constexpr double kMinLegendWidth = 14.0;
constexpr double kBarWidth = 1.2;
constexpr double kLineHeight = 1.5;
constexpr double kTitleSize = 1.15;
constexpr double kLegendGap = 1.6;  // between entries
constexpr double kSwatchGap = 0.5;  // between a swatch and its text

/// @param tick_spacing  least distance between ticks over the axis' length
AxisLayout make_axis(double first, int samples, double resolution, double tick_spacing) {
  AxisLayout axis;
  axis.low = first - 0.5 * resolution;
  axis.high = first + (samples - 0.5) * resolution;
  axis.step = round_step((axis.high - axis.low) * tick_spacing);
  axis.ticks = multiples(axis.low, axis.high, axis.step);
  return axis;
}

double widest_label(const std::vector<double>& values, double step, double font) {
  double width = 0.0;
  for (const double value : values) {
    width = std::max(width, text_width(label_of(value, step), font));
  }
  return width;
}

std::vector<LegendEntry> legend_entries(const SliceImage& slice, const DistanceScale& scale) {
  std::vector<LegendEntry> entries;
  if (scale.has_surface) entries.push_back({LegendKind::kSurface, "surface", {}});
  if (!scale.iso_levels().empty()) {
    const std::string step = label_of(scale.iso_step, scale.iso_step);
    entries.push_back({LegendKind::kIsoLine, "iso-lines every " + step + " m", {}});
  }
  if (!slice.gradient_u.empty()) entries.push_back({LegendKind::kArrow, "gradient, slope 1", {}});
  if (scale.has_bound) entries.push_back({LegendKind::kBound, "lower bound only", {}});
  if (scale.has_unknown) entries.push_back({LegendKind::kUnknown, "unknown", {}});
  return entries;
}

/// Sets the entries in lines of the given width; returns the y below the last.
double place_legend(FigureLayout& layout, double x0, double width, double y) {
  const double font = layout.font;
  double x = x0;
  for (LegendEntry& entry : layout.legend) {
    const double entry_width = (kSwatchWidth + kSwatchGap) * font + text_width(entry.text, font);
    if (x > x0 && x + entry_width > x0 + width) {
      x = x0;
      y += kLineHeight * font;
    }
    entry.place = {x, y};
    x += entry_width + kLegendGap * font;
  }
  return y + 0.5 * kLineHeight * font;
}

int to_pixels(double length) { return static_cast<int>(std::ceil(length)); }

void check_size(double width, double height) {
  if (width <= kMaxPictureSide && height <= kMaxPictureSide) return;
  throw Error(ErrorCode::kUsage,
              "a picture of " + std::to_string(std::lround(width)) + " x " +
                  std::to_string(std::lround(height)) + " pixels is too large; " +
                  std::to_string(kMaxPictureSide) +
                  " a side is the most: choose a coarser resolution or a region");
}

/// The plot's size and what is in proportion to it.
void set_scale(FigureLayout& layout, const SliceImage& slice) {
  const double longer = std::max(slice.width, slice.height);
  check_size(longer, longer);
  layout.pixels_per_sample = std::max(1, static_cast<int>(std::lround(kPlotSide / longer)));
  layout.plot.width = slice.width * layout.pixels_per_sample;
  layout.plot.height = slice.height * layout.pixels_per_sample;
  layout.font = std::max(kMinFont, kFontShare * std::max(layout.plot.width, layout.plot.height));
}

}  // namespace

FigureLayout make_layout(const SliceImage& slice, const DistanceScale& scale) {
  FigureLayout layout;
  set_scale(layout, slice);
  const double font = layout.font;
  const double spacing = kTickSpacing * font;
  layout.u = make_axis(slice.u0, slice.width, slice.resolution, spacing / layout.plot.width);
  layout.v = make_axis(slice.v0, slice.height, slice.resolution, spacing / layout.plot.height);
  if (layout.v.ticks.size() < 3) {
    layout.v = make_axis(slice.v0, slice.height, slice.resolution,
                         kDenseTickSpacing * font / layout.plot.height);
  }
  layout.legend = legend_entries(slice, scale);

  // From left to right.
  const double tick = (kTickLength + kTickGap) * font;
  const double padding = kPadding * font;
  layout.v_label_x = padding + 0.5 * font;
  layout.plot.x =
      std::ceil(layout.v_label_x + font + tick + widest_label(layout.v.ticks, layout.v.step, font));
  layout.bar.x = layout.plot.right() + kBarGap * font;
  layout.bar.width = kBarWidth * font;
  const double bar_numbers =
      std::max(widest_label(scale.ticks(), scale.tick_step, font),
               text_width("\u2265 " + label_of(scale.end, scale.tick_step), font));
  layout.bar_label_x = layout.bar.right() + tick + bar_numbers + font;

  // From top to bottom.
  layout.title_size = kTitleSize * font;
  const double above = slice.title.empty() ? font : (kLineHeight + 0.5) * layout.title_size;
  layout.plot.y = layout.bar.y = std::ceil(above);
  layout.bar.height = std::max(layout.plot.height, text_width(kBarLabel, font));
  layout.u_label_y = layout.plot.bottom() + tick + 1.9 * font;
  // A bar that is longer than a flat plot stands beside the legend.
  const double right = layout.bar_label_x + 0.5 * font + padding;
  const bool is_flat = layout.bar.bottom() > layout.u_label_y;
  const double legend_width =
      is_flat ? layout.plot.width
              : std::max(right - layout.plot.x - padding, kMinLegendWidth * font);
  const double legend_bottom = place_legend(layout, layout.plot.x, legend_width,
                                            layout.u_label_y + 1.4 * kLineHeight * font);

  double wanted = right;
  for (const LegendEntry& entry : layout.legend) {
    wanted = std::max(wanted, entry.place.x + (kSwatchWidth + kSwatchGap) * font +
                                  text_width(entry.text, font) + padding);
  }
  const double bottom = std::max(legend_bottom, layout.bar.bottom() + 0.5 * font);
  check_size(wanted, bottom + padding);
  layout.width = to_pixels(wanted);
  layout.height = to_pixels(bottom + 0.5 * padding);
  return layout;
}

}  // namespace gdfmap::drawing
