#include "contour_labels.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

namespace gdfmap::drawing {
namespace {

constexpr double kMinStraightness = 0.97;  // chord over arc along the label
constexpr double kMinLineLength = 4.0;     // in label lengths
constexpr double kLabelSpacing = 7.0;      // between labels, in text sizes
constexpr double kLabelPadding = 0.6;      // of the gap, in text sizes

/// A line by arc length.
class Ruler {
 public:
  explicit Ruler(const Polyline& line) : line_(line), lengths_(line.size(), 0.0) {
    for (std::size_t i = 1; i < line.size(); ++i) {
      lengths_[i] =
          lengths_[i - 1] + std::hypot(line[i].x - line[i - 1].x, line[i].y - line[i - 1].y);
    }
  }

  [[nodiscard]] double length() const { return lengths_.back(); }
  /// First point further along than `s`.
  [[nodiscard]] std::size_t index_after(double s) const {
    const auto found = std::upper_bound(lengths_.begin(), lengths_.end(), s);
    return static_cast<std::size_t>(found - lengths_.begin());
  }
  [[nodiscard]] Point at(double s) const {
    const std::size_t i = std::clamp<std::size_t>(index_after(s), 1, line_.size() - 1);
    const double span = lengths_[i] - lengths_[i - 1];
    const double t = span > 0.0 ? (s - lengths_[i - 1]) / span : 0.0;
    return {line_[i - 1].x + t * (line_[i].x - line_[i - 1].x),
            line_[i - 1].y + t * (line_[i].y - line_[i - 1].y)};
  }

 private:
  const Polyline& line_;
  std::vector<double> lengths_;
};

struct Candidate {
  double begin = 0.0, end = 0.0;
  Point centre;
  double angle = 0.0;
};

double upright(double angle) {
  if (angle > 0.5 * std::numbers::pi) return angle - std::numbers::pi;
  if (angle <= -0.5 * std::numbers::pi) return angle + std::numbers::pi;
  return angle;
}

bool is_inside(const Point& p, const Rectangle& area, double margin) {
  return p.x >= area.x + margin && p.x <= area.right() - margin && p.y >= area.y + margin &&
         p.y <= area.bottom() - margin;
}

bool is_apart(const Point& p, const std::vector<Point>& taken, double spacing) {
  return std::all_of(taken.begin(), taken.end(), [&](const Point& other) {
    return std::hypot(p.x - other.x, p.y - other.y) >= spacing;
  });
}

/// The straightest place of a line for a label that takes `span` of it.
std::optional<Candidate> best_place(const Polyline& line, double span, const Rectangle& area,
                                    const std::vector<Point>& taken, double spacing) {
  const Ruler ruler(line);
  if (ruler.length() < kMinLineLength * span) return std::nullopt;
  std::optional<Candidate> best;
  double best_straightness = kMinStraightness;
  for (double s = 0.25 * span; s + 1.25 * span <= ruler.length(); s += 0.25 * span) {
    const Point begin = ruler.at(s), end = ruler.at(s + span);
    const double straightness = std::hypot(end.x - begin.x, end.y - begin.y) / span;
    const Point centre{0.5 * (begin.x + end.x), 0.5 * (begin.y + end.y)};
    if (straightness <= best_straightness || !is_inside(centre, area, 0.6 * span) ||
        !is_apart(centre, taken, spacing)) {
      continue;
    }
    best_straightness = straightness;
    best = {s, s + span, centre, upright(std::atan2(end.y - begin.y, end.x - begin.x))};
  }
  return best;
}

}  // namespace

void place_labels(std::vector<LabelledLine>& lines, const Rectangle& area, double text_size) {
  std::vector<std::size_t> order(lines.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<double> lengths;
  for (const LabelledLine& line : lines) lengths.push_back(Ruler(line.points).length());
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return lengths[a] > lengths[b]; });
  std::vector<Point> taken;
  for (const std::size_t i : order) {
    LabelledLine& line = lines[i];
    const double span = text_width(line.text, text_size) + kLabelPadding * text_size;
    const auto place = best_place(line.points, span, area, taken, kLabelSpacing * text_size);
    if (!place) continue;
    line.has_label = true;
    line.gap_begin = place->begin;
    line.gap_end = place->end;
    line.label_centre = place->centre;
    line.label_angle = place->angle;
    taken.push_back(place->centre);
  }
}

std::vector<Polyline> pieces(const LabelledLine& line) {
  if (!line.has_label) return {line.points};
  const Ruler ruler(line.points);
  const auto at = [&](std::size_t i) {
    return line.points.begin() + static_cast<std::ptrdiff_t>(i);
  };
  Polyline before(line.points.begin(), at(ruler.index_after(line.gap_begin)));
  before.push_back(ruler.at(line.gap_begin));
  Polyline after = {ruler.at(line.gap_end)};
  after.insert(after.end(), at(ruler.index_after(line.gap_end)), line.points.end());
  return {before, after};
}

}  // namespace gdfmap::drawing
