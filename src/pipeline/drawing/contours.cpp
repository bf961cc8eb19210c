#include "contours.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace gdfmap::drawing {
namespace {

/// An edge of the grid that the line crosses: two per grid point, to the right and upwards.
using EdgeId = std::uint64_t;

struct Segment {
  std::array<EdgeId, 2> ends;
};

class ContourTracer {
 public:
  ContourTracer(const Grid& grid, double level) : grid_(grid), level_(level) {
    for (int j = 0; j + 1 < grid.height; ++j) {
      for (int i = 0; i + 1 < grid.width; ++i) add_cell(i, j);
    }
    used_.resize(segments_.size());
    link_ends();
  }

  std::vector<Polyline> trace() {
    std::vector<Polyline> lines;
    // Open lines start where an edge belongs to one segment; what is left afterwards is closed.
    for (const End& end : ends_) {
      if (!used_[end.segment] && segments_at(end.edge).size() == 1) {
        lines.push_back(follow(end.edge));
      }
    }
    for (std::size_t s = 0; s < segments_.size(); ++s) {
      if (!used_[s]) lines.push_back(follow(segments_[s].ends[0]));
    }
    return lines;
  }

 private:
  struct End {
    EdgeId edge;
    std::size_t segment;
  };

  [[nodiscard]] EdgeId edge(int i, int j, bool upwards) const {
    const auto point =
        static_cast<EdgeId>(j) * static_cast<EdgeId>(grid_.width) + static_cast<EdgeId>(i);
    return 2 * point + (upwards ? 1 : 0);
  }

  /// Connects the crossed edges of the cell whose lower left corner is (i, j).
  void add_cell(int i, int j) {
    const std::array<double, 4> corners = {value(i, j), value(i + 1, j), value(i + 1, j + 1),
                                           value(i, j + 1)};
    std::array<EdgeId, 4> crossed{};
    std::size_t count = 0;
    const std::array<EdgeId, 4> edges = {edge(i, j, false), edge(i + 1, j, true),
                                         edge(i, j + 1, false), edge(i, j, true)};
    for (std::size_t k = 0; k < 4; ++k) {
      if (std::isnan(corners[k])) return;
      if (is_above(corners[k]) != is_above(corners[(k + 1) % 4])) crossed[count++] = edges[k];
    }
    if (count == 2) segments_.push_back({{crossed[0], crossed[1]}});
    if (count < 4) return;
    // A saddle: the corners that agree with the centre are joined, so the others are cut off.
    const double centre = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
    const std::size_t first = is_above(centre) == is_above(corners[0]) ? 0 : 3;
    segments_.push_back({{crossed[first], crossed[(first + 1) % 4]}});
    segments_.push_back({{crossed[(first + 2) % 4], crossed[(first + 3) % 4]}});
  }

  [[nodiscard]] double value(int i, int j) const { return static_cast<double>(grid_.at(i, j)); }
  [[nodiscard]] bool is_above(double v) const { return v >= level_; }

  void link_ends() {
    for (std::size_t s = 0; s < segments_.size(); ++s) {
      for (const EdgeId e : segments_[s].ends) ends_.push_back({e, s});
    }
    std::sort(ends_.begin(), ends_.end(), [](const End& a, const End& b) {
      return a.edge != b.edge ? a.edge < b.edge : a.segment < b.segment;
    });
  }

  /// One or two segments end on an edge.
  [[nodiscard]] std::span<const End> segments_at(EdgeId e) const {
    const auto first = std::lower_bound(ends_.begin(), ends_.end(), e,
                                        [](const End& end, EdgeId id) { return end.edge < id; });
    auto last = first;
    while (last != ends_.end() && last->edge == e) ++last;
    return {first, last};
  }

  Polyline follow(EdgeId from) {
    Polyline line = {crossing(from)};
    for (bool moved = true; moved;) {
      moved = false;
      for (const End& end : segments_at(from)) {
        if (used_[end.segment]) continue;
        used_[end.segment] = true;
        const auto& ends = segments_[end.segment].ends;
        from = ends[0] == from ? ends[1] : ends[0];
        line.push_back(crossing(from));
        moved = true;
        break;
      }
    }
    return line;
  }

  [[nodiscard]] Point crossing(EdgeId e) const {
    const bool upwards = e % 2 == 1;
    const int i = static_cast<int>(e / 2 % static_cast<EdgeId>(grid_.width));
    const int j = static_cast<int>(e / 2 / static_cast<EdgeId>(grid_.width));
    const double low = value(i, j);
    const double high = upwards ? value(i, j + 1) : value(i + 1, j);
    const double t = (level_ - low) / (high - low);
    return upwards ? Point{static_cast<double>(i), j + t} : Point{i + t, static_cast<double>(j)};
  }

  Grid grid_;
  double level_;
  std::vector<Segment> segments_;
  std::vector<End> ends_;  ///< by edge
  std::vector<bool> used_;
};

}  // namespace

std::vector<Polyline> contours(const Grid& grid, double level) {
  return ContourTracer(grid, level).trace();
}

}  // namespace gdfmap::drawing
