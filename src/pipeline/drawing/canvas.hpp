#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include <gdfmap/core/bytes.hpp>

#include "color_map.hpp"

namespace gdfmap::drawing {

/// Pixels, x to the right, y downwards.
struct Point {
  double x = 0.0, y = 0.0;
};

struct Rectangle {
  double x = 0.0, y = 0.0, width = 0.0, height = 0.0;
  [[nodiscard]] double right() const { return x + width; }
  [[nodiscard]] double bottom() const { return y + height; }
};

struct Stroke {
  Color color = kBlack;
  double width = 1.0;  ///< pixels
  double opacity = 1.0;
  double dash = 0.0;  ///< length of dashes and of the gaps between them, pixels; 0: none
};

enum class Align { kStart, kCentre, kEnd };

struct TextStyle {
  double size = 14.0;  ///< em, pixels
  Color color = kBlack;
  Align align = Align::kStart;  ///< of the text along its baseline
  double angle = 0.0;           ///< radians, clockwise
};

/// A picture in memory that starts white. Not thread-safe.
class Canvas {
 public:
  /// @throws Error kInternal when there is no memory for it.
  Canvas(int width, int height);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  /// Sets every pixel of a rectangle; color(x, y) counts from its corner.
  /// @throws Error kInternal when it reaches beyond the picture.
  void fill_pixels(int x, int y, int width, int height,
                   const std::function<Color(int, int)>& color);
  void stroke_line(std::span<const Point> points, const Stroke& stroke);
  void fill_polygon(std::span<const Point> corners, const Color& color);
  void stroke_rectangle(const Rectangle& rectangle, const Stroke& stroke);
  /// @param anchor  where the text is aligned to; vertically the middle of its figures
  void text(const std::string& text, const Point& anchor, const TextStyle& style);

  [[nodiscard]] Bytes png() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Advance width, pixels.
[[nodiscard]] double text_width(const std::string& text, double size);

}  // namespace gdfmap::drawing
