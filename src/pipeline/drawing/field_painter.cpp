#include "field_painter.hpp"

#include <algorithm>
#include <cmath>

namespace gdfmap::drawing {
namespace {

constexpr Color kUnknownGround{0.93, 0.93, 0.93};
constexpr Color kUnknownStripe{0.62, 0.62, 0.62};
constexpr double kPaleness = 0.55;
constexpr double kBoundStripe = 0.6;

/// Distances by pixel of the plot.
class Sampler {
 public:
  Sampler(const SliceImage& slice, int pixels_per_sample)
      : slice_(slice), pixels_per_sample_(pixels_per_sample) {}

  struct Value {
    double distance;
    bool is_bound;
  };

  /// y counts downwards from the plot's top.
  [[nodiscard]] Value at(int x, int y) const {
    const int i = x / pixels_per_sample_;
    const int j = slice_.height - 1 - y / pixels_per_sample_;
    const double nearest = distance(i, j);
    const bool is_bound = !slice_.is_bound.empty() && slice_.is_bound[index(i, j)] != 0;
    if (pixels_per_sample_ == 1 || !std::isfinite(nearest)) return {nearest, is_bound};
    const double smooth = interpolated(grid_x(x), grid_y(y));
    return {std::isfinite(smooth) ? smooth : nearest, is_bound};
  }

 private:
  [[nodiscard]] std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(slice_.width) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] double distance(int i, int j) const {
    return static_cast<double>(slice_.distance[index(i, j)]);
  }
  [[nodiscard]] double grid_x(int x) const {
    return std::clamp((x + 0.5) / pixels_per_sample_ - 0.5, 0.0, slice_.width - 1.0);
  }
  [[nodiscard]] double grid_y(int y) const {
    const double from_bottom = slice_.height - (y + 0.5) / pixels_per_sample_;
    return std::clamp(from_bottom - 0.5, 0.0, slice_.height - 1.0);
  }

  [[nodiscard]] double interpolated(double gx, double gy) const {
    const int i = std::min(static_cast<int>(gx), std::max(slice_.width - 2, 0));
    const int j = std::min(static_cast<int>(gy), std::max(slice_.height - 2, 0));
    const int right = std::min(i + 1, slice_.width - 1), up = std::min(j + 1, slice_.height - 1);
    const double tx = gx - i, ty = gy - j;
    const double low = (1.0 - tx) * distance(i, j) + tx * distance(right, j);
    const double high = (1.0 - tx) * distance(i, up) + tx * distance(right, up);
    return (1.0 - ty) * low + ty * high;
  }

  const SliceImage& slice_;
  int pixels_per_sample_;
};

/// How much of a pixel the surface's line covers.
double surface_coverage(double distance, double surface) {
  return std::clamp((1.2 * surface - distance) / (0.6 * surface), 0.0, 1.0);
}

}  // namespace

double stripe(double place, double period) {
  const double phase = place / period - std::floor(place / period);
  const double from_centre = period * std::abs(phase - 0.5);
  return std::clamp(period / 8.0 - from_centre + 0.5, 0.0, 1.0);
}

Color unknown_color(int x, int y, double period) {
  return mix(kUnknownGround, kUnknownStripe, stripe(x + y, period));
}

Color bound_color(const Color& color, int x, int y, double period) {
  return mix(mix(color, kWhite, kPaleness), kWhite, kBoundStripe * stripe(x - y, period));
}

double hatch_period(double font) { return std::max(6.0, std::round(0.6 * font)); }

void paint_field(Canvas& canvas, const SliceImage& slice, const DistanceScale& scale,
                 const FigureLayout& layout) {
  const Sampler sampler(slice, layout.pixels_per_sample);
  const double period = hatch_period(layout.font);
  const auto color = [&](int x, int y) {
    const auto [distance, is_bound] = sampler.at(x, y);
    if (!std::isfinite(distance)) return unknown_color(x, y, period);
    if (is_bound) return bound_color(scale.color(distance), x, y, period);
    return mix(scale.color(distance), kBlack, surface_coverage(distance, scale.surface));
  };
  canvas.fill_pixels(static_cast<int>(layout.plot.x), static_cast<int>(layout.plot.y),
                     static_cast<int>(layout.plot.width), static_cast<int>(layout.plot.height),
                     color);
}

}  // namespace gdfmap::drawing
