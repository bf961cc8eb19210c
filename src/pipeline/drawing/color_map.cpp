#include "color_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace gdfmap::drawing {
namespace {

constexpr int kTableSize = 512;

double to_srgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

double to_linear(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

struct Linear {
  double red, green, blue;
};

/// Oklab (B. Ottosson, 2020) to linear sRGB; hue in degrees.
Linear from_oklch(double lightness, double chroma, double hue) {
  const double a = chroma * std::cos(hue * std::numbers::pi / 180.0);
  const double b = chroma * std::sin(hue * std::numbers::pi / 180.0);
  const double l = std::pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3.0);
  const double m = std::pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3.0);
  const double s = std::pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3.0);
  return {4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
          -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
          -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s};
}

/// Chroma stays within what sRGB can show at every lightness and hue of the path.
Color table_entry(double t) {
  const double lightness = 0.22 + 0.74 * t;
  const double hue = 295.0 - 190.0 * std::pow(t, 1.2);
  const double chroma = 0.098 + 0.03 * std::pow(t, 4.0);
  const auto [red, green, blue] = from_oklch(lightness, chroma, hue);
  return {to_srgb(red), to_srgb(green), to_srgb(blue)};
}

std::array<Color, kTableSize> make_table() {
  std::array<Color, kTableSize> table;
  for (std::size_t i = 0; i < table.size(); ++i) {
    table[i] = table_entry(static_cast<double>(i) / (kTableSize - 1));
  }
  return table;
}

}  // namespace

double luminance(const Color& color) {
  return 0.2126 * to_linear(color.red) + 0.7152 * to_linear(color.green) +
         0.0722 * to_linear(color.blue);
}

Color color_at(double t) {
  static const std::array<Color, kTableSize> table = make_table();
  const double place = std::clamp(t, 0.0, 1.0) * (kTableSize - 1);
  const auto index = std::min(static_cast<std::size_t>(place), table.size() - 2);
  return mix(table[index], table[index + 1], place - static_cast<double>(index));
}

}  // namespace gdfmap::drawing
