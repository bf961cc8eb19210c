#include "ticks.hpp"

#include <charconv>
#include <cmath>
#include <initializer_list>

namespace gdfmap::drawing {
namespace {

constexpr double kSlack = 1e-6;

double first_round(double value, std::initializer_list<double> mantissas) {
  const double decade = std::pow(10.0, std::floor(std::log10(value) + kSlack));
  for (const double mantissa : mantissas) {
    if (mantissa * decade >= value * (1.0 - kSlack)) return mantissa * decade;
  }
  return 10.0 * decade;
}

}  // namespace

double round_step(double at_least) { return first_round(at_least, {1.0, 2.0, 2.5, 5.0}); }

double round_end(double value) {
  return first_round(value, {1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0});
}

std::vector<double> multiples(double low, double high, double step) {
  std::vector<double> values;
  const double first = std::ceil(low / step - kSlack), last = std::floor(high / step + kSlack);
  for (double k = first; k <= last; k += 1.0) values.push_back(k * step);
  return values;
}

std::string label_of(double value, double step) {
  int decimals = 0;
  double scaled = step;
  while (decimals < 6 && std::abs(scaled - std::round(scaled)) > 1e-6 * scaled) {
    scaled *= 10.0;
    ++decimals;
  }
  if (std::abs(value) < 1e-6 * step) value = 0.0;
  char text[64];
  const auto end =
      std::to_chars(text, text + sizeof(text), std::abs(value), std::chars_format::fixed, decimals)
          .ptr;
  return (value < 0.0 ? "\u2212" : "") + std::string(text, end);
}

}  // namespace gdfmap::drawing
