#pragma once

namespace gdfmap::drawing {

/// sRGB, each in [0, 1].
struct Color {
  double red = 0.0, green = 0.0, blue = 0.0;
};

inline constexpr Color kBlack{0.0, 0.0, 0.0};
inline constexpr Color kWhite{1.0, 1.0, 1.0};

[[nodiscard]] constexpr Color mix(const Color& a, const Color& b, double share_of_b) {
  return {a.red + (b.red - a.red) * share_of_b, a.green + (b.green - a.green) * share_of_b,
          a.blue + (b.blue - a.blue) * share_of_b};
}

/// Perceived brightness in [0, 1], linear light weighted as the eye does.
[[nodiscard]] double luminance(const Color& color);

/// Whether white lines are seen better on it than black ones.
[[nodiscard]] inline bool is_dark(const Color& color) { return luminance(color) < 0.25; }

/// Dark violet at 0 over blue and green to light yellow at 1. Lightness grows evenly, so that the
/// order survives grey print, and the hue runs from blue to yellow, which most colour-blind eyes
/// tell apart. Values outside [0, 1] are clamped.
[[nodiscard]] Color color_at(double t);

}  // namespace gdfmap::drawing
