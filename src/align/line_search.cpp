#include "line_search.hpp"

#include <algorithm>
#include <cmath>

namespace gdfmap {
namespace {

constexpr double kSufficientDecrease = 1e-4;
constexpr double kCurvature = 0.9;
constexpr double kLongest = 4.0, kShortest = 1e-6;
constexpr int kMaxTrials = 10;

struct Place {
  double step = 0.0;
  LineValue f;
};

/// Minimiser of the cubic through values and slopes at both places.
double cubic_minimum(const Place& a, const Place& b) {
  const double theta = 3.0 * (a.f.value - b.f.value) / (b.step - a.step) + a.f.slope + b.f.slope;
  const double discriminant = std::max(0.0, theta * theta - a.f.slope * b.f.slope);
  const double gamma = std::copysign(std::sqrt(discriminant), b.step - a.step);
  const double p = gamma - a.f.slope + theta, q = 2.0 * gamma - a.f.slope + b.f.slope;
  return q == 0.0 ? 0.5 * (a.step + b.step) : a.step + p / q * (b.step - a.step);
}

/// Minimiser of the parabola through the value and slope at a and the value at b.
double parabola_minimum(const Place& a, const Place& b) {
  const double width = b.step - a.step;
  const double rise = (a.f.value - b.f.value) / width + a.f.slope;
  return rise == 0.0 ? 0.5 * (a.step + b.step) : a.step + 0.5 * a.f.slope / rise * width;
}

/// Where the slope, linear between both, vanishes.
double secant(const Place& a, const Place& b) {
  const double change = b.f.slope - a.f.slope;
  return change == 0.0 ? b.step : b.step - b.f.slope / change * (b.step - a.step);
}

/// The interval of uncertainty: `best` has the lowest value so far, `other` is its other end.
struct Interval {
  Place best, other;
  bool is_bracketed = false;

  /// The next trial after `t` (section 4 of the paper), and the interval that it leaves.
  double advance(const Place& t);

 private:
  [[nodiscard]] double within(double next, const Place& t) const;
  void update(const Place& t);
};

double Interval::advance(const Place& t) {
  double next = 0.0;
  const double cubic = cubic_minimum(best, t);
  if (t.f.value > best.f.value) {  // case 1: too far, the minimum lies between
    const double parabola = parabola_minimum(best, t);
    next = std::abs(cubic - best.step) < std::abs(parabola - best.step)
               ? cubic
               : cubic + 0.5 * (parabola - cubic);
    is_bracketed = true;
  } else if (t.f.slope * best.f.slope < 0.0) {  // case 2: lower, and the slope changed sign
    const double linear = secant(best, t);
    next = std::abs(cubic - t.step) > std::abs(linear - t.step) ? cubic : linear;
    is_bracketed = true;
  } else if (std::abs(t.f.slope) <= std::abs(best.f.slope)) {  // case 3: lower, and flatter
    const double linear = secant(best, t);
    const bool is_beyond = (cubic - t.step) * (t.step - best.step) > 0.0;
    next = is_beyond && std::abs(cubic - t.step) < std::abs(linear - t.step) ? cubic : linear;
    next = within(next, t);
  } else {  // case 4: lower, and steeper
    next = is_bracketed ? cubic_minimum(t, other) : (t.step > best.step ? kLongest : kShortest);
  }
  update(t);
  return std::clamp(next, kShortest, kLongest);
}

/// Not past two thirds of the way to the other end.
double Interval::within(double next, const Place& t) const {
  if (!is_bracketed) return next;
  const double limit = t.step + 0.66 * (other.step - t.step);
  return t.step > best.step ? std::min(limit, next) : std::max(limit, next);
}

void Interval::update(const Place& t) {
  if (t.f.value > best.f.value) {
    other = t;
    return;
  }
  if (t.f.slope * best.f.slope < 0.0) other = best;
  best = t;
}

}  // namespace

double line_search(const LineValue& start, const std::function<LineValue(double)>& at) {
  const double decrease = kSufficientDecrease * start.slope;
  Place lowest{0.0, start};
  Interval interval{{0.0, start}, {0.0, start}, false};
  // At first the search is for a zero of ψ(t) = f(t) − f(0) − µ f'(0) t, whose minimiser meets
  // the condition of decrease; once ψ ≤ 0 with a rising f, of f itself.
  bool uses_psi = true;
  double step = 1.0;
  for (int trial = 0; trial < kMaxTrials; ++trial) {
    const LineValue f = at(step);
    if (f.value < lowest.f.value) lowest = {step, f};
    const bool falls_enough = f.value <= start.value + step * decrease;
    if (falls_enough && std::abs(f.slope) <= -kCurvature * start.slope) return step;
    if (uses_psi && falls_enough && f.slope >= 0.0) uses_psi = false;
    const auto psi = [&](Place p) {
      p.f.value -= p.step * decrease;
      p.f.slope -= decrease;
      return p;
    };
    double next = 0.0;
    if (uses_psi) {
      Interval modified{psi(interval.best), psi(interval.other), interval.is_bracketed};
      next = modified.advance(psi({step, f}));
      const auto back = [&](Place p) {
        p.f.value += p.step * decrease;
        p.f.slope += decrease;
        return p;
      };
      interval = {back(modified.best), back(modified.other), modified.is_bracketed};
    } else {
      next = interval.advance({step, f});
    }
    if (std::abs(next - step) < kShortest) break;
    step = next;
  }
  return lowest.step;
}

}  // namespace gdfmap
