#include "arrows.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace gdfmap::drawing {
namespace {

// Shares of an arrow's length, and bounds of its head in pixels.
constexpr double kHeadLength = 0.4;
constexpr double kMinHead = 3.0, kMaxHead = 9.0;
constexpr double kHeadAspect = 0.4;  ///< half the head's width over its length
constexpr double kMinLength = 2.0;
constexpr double kLineWidth = 1.3;
/// Between arrows, in lengths of one that stands for a slope of 1.
constexpr double kSpacing = 1.35;

/// Draws the arrows of one slice.
class Arrows {
 public:
  Arrows(Canvas& canvas, const SliceImage& slice, const DistanceScale& scale,
         const FigureLayout& layout)
      : canvas_(canvas),
        slice_(slice),
        scale_(scale),
        layout_(layout),
        length_(kSwatchWidth * layout.font),
        stride_(std::max(
            1, static_cast<int>(std::lround(kSpacing * length_ / layout.pixels_per_sample)))) {}

  void draw() {
    for (int j = stride_ / 2; j < slice_.height; j += stride_) {
      for (int i = stride_ / 2; i < slice_.width; i += stride_) draw_at(i, j);
    }
  }

 private:
  /// The arrow's middle is the place that it speaks of.
  void draw_at(int i, int j) {
    const std::size_t n = static_cast<std::size_t>(j) * static_cast<std::size_t>(slice_.width) +
                          static_cast<std::size_t>(i);
    const auto u = static_cast<double>(slice_.gradient_u[n]);
    const auto v = static_cast<double>(slice_.gradient_v[n]);
    const auto distance = static_cast<double>(slice_.distance[n]);
    if (!std::isfinite(u) || !std::isfinite(v) || !std::isfinite(distance)) return;
    const bool is_bound = !slice_.is_bound.empty() && slice_.is_bound[n] != 0;
    const double s = layout_.pixels_per_sample;
    const Point centre{layout_.plot.x + (i + 0.5) * s, layout_.plot.bottom() - (j + 0.5) * s};
    const double scale = 0.5 * length_ / std::max(1.0, std::hypot(u, v));
    const Point from{centre.x - scale * u, centre.y + scale * v};
    const Point to{centre.x + scale * u, centre.y - scale * v};
    if (!is_in_plot(from) || !is_in_plot(to)) return;
    draw_arrow(canvas_, from, to, !is_bound && is_dark(scale_.color(distance)) ? kWhite : kBlack);
  }

  [[nodiscard]] bool is_in_plot(const Point& p) const {
    const Rectangle& plot = layout_.plot;
    return p.x >= plot.x && p.x <= plot.right() && p.y >= plot.y && p.y <= plot.bottom();
  }

  Canvas& canvas_;
  const SliceImage& slice_;
  const DistanceScale& scale_;
  const FigureLayout& layout_;
  double length_;  ///< of a slope of 1, pixels
  int stride_;     ///< samples
};

}  // namespace

void draw_arrow(Canvas& canvas, const Point& from, const Point& to, const Color& color) {
  const double length = std::hypot(to.x - from.x, to.y - from.y);
  if (length < kMinLength) return;
  const double head = std::min(length, std::clamp(kHeadLength * length, kMinHead, kMaxHead));
  const Point along{(to.x - from.x) / length, (to.y - from.y) / length};
  const Point neck{to.x - head * along.x, to.y - head * along.y};
  const double half = kHeadAspect * head;
  canvas.stroke_line(std::array{from, neck}, {color, kLineWidth});
  canvas.fill_polygon(std::array{to, Point{neck.x - half * along.y, neck.y + half * along.x},
                                 Point{neck.x + half * along.y, neck.y - half * along.x}},
                      color);
}

void draw_gradients(Canvas& canvas, const SliceImage& slice, const DistanceScale& scale,
                    const FigureLayout& layout) {
  if (!slice.gradient_u.empty()) Arrows(canvas, slice, scale, layout).draw();
}

}  // namespace gdfmap::drawing
