#include "cube_size.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace gdfmap::gdf1 {
namespace {

constexpr double kDecimalsStep = 1e-6;  // of coordinates printed with six decimals
/// A remainder below this share of the step is rounding, not a smaller step.
constexpr double kRemainderTolerance = 0.02;
/// Coordinates without a common step end up with one of the order of their rounding.
constexpr double kMinStepsPerSize = 5.0;

/// What two rounded coordinates may differ by though they are meant to be the same.
double rounding_of(double largest) {
  return kDecimalsStep + largest * static_cast<double>(std::numeric_limits<float>::epsilon());
}

/// Differences between neighbouring distinct coordinates of each axis, or, where there are none,
/// the coordinates themselves, which are multiples of the size too.
std::vector<double> steps_between(const std::array<std::vector<float>, 3>& origins,
                                  double rounding) {
  std::vector<double> steps, magnitudes;
  for (std::vector<float> axis : origins) {
    std::erase_if(axis, [](float v) { return !std::isfinite(v); });
    std::sort(axis.begin(), axis.end());
    for (std::size_t i = 0; i < axis.size(); ++i) {
      const auto value = static_cast<double>(axis[i]);
      if (std::abs(value) > rounding) magnitudes.push_back(std::abs(value));
      const double step = i == 0 ? 0.0 : value - static_cast<double>(axis[i - 1]);
      if (step > rounding) steps.push_back(step);
    }
  }
  std::vector<double>& result = steps.empty() ? magnitudes : steps;
  std::sort(result.begin(), result.end());
  return result;
}

double largest_magnitude(const std::array<std::vector<float>, 3>& origins) {
  double largest = 0.0;
  for (const auto& axis : origins) {
    for (const float v : axis) {
      if (std::isfinite(v)) largest = std::max(largest, std::abs(static_cast<double>(v)));
    }
  }
  return largest;
}

/// A common divisor of both, and how well it is known.
struct Divisor {
  double size;
  double rounding;
};

Divisor common_divisor(Divisor divisor, double step, double rounding) {
  double a = step, b = divisor.size;
  while (true) {
    const double remainder = std::abs(a - std::round(a / b) * b);
    if (remainder <= std::max(kRemainderTolerance * b, 2.0 * rounding)) break;
    a = b;
    b = remainder;
  }
  // The longest step tells the size best: its rounding is shared by many cubes.
  const double multiple = std::max(1.0, std::round(step / b));
  return {step / multiple, rounding / multiple};
}

double parse(const char* begin, const char* end) {
  double value = 0.0;
  std::from_chars(begin, end, value);
  return value;
}

/// The shortest decimal within what is known of the size.
double snapped(const Divisor& divisor) {
  for (int digits = 1; digits < 9; ++digits) {
    char text[32];
    const auto end =
        std::to_chars(text, text + sizeof(text), divisor.size, std::chars_format::general, digits)
            .ptr;
    const double candidate = parse(text, end);
    if (std::abs(candidate - divisor.size) <= 2.0 * divisor.rounding) return candidate;
  }
  return divisor.size;
}

}  // namespace

double decimal_of(float value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof(text), value).ptr;
  return parse(text, end);
}

std::optional<double> deduce_cube_size(const std::array<std::vector<float>, 3>& origins) {
  const double rounding = rounding_of(largest_magnitude(origins));
  const std::vector<double> steps = steps_between(origins, rounding);
  if (steps.empty()) return std::nullopt;
  Divisor divisor{steps.front(), rounding};
  for (const double step : steps) divisor = common_divisor(divisor, step, rounding);
  if (divisor.size < kMinStepsPerSize * rounding) return std::nullopt;
  return snapped(divisor);
}

}  // namespace gdfmap::gdf1
