#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/map_plot.hpp>

#include "drawing/chart.hpp"
#include "drawing/field_painter.hpp"
#include "drawing/ticks.hpp"

namespace gdfmap {
namespace drawing {
namespace {

constexpr std::int64_t kMaxCells = 200;  ///< along the longer side
constexpr int kPlotSide = 800;           ///< pixels, of the longer side at most
constexpr int kMaxCellPixels = 120;
constexpr double kFont = 16.0;
constexpr Color kNoPoints{0.86, 0.86, 0.86};  ///< cubes alone
constexpr double kStripeOpacity = 0.75;

// Pixels around the plot.
constexpr double kLeft = 100.0, kTop = 30.0, kBarGap = 30.0, kBarWidth = 20.0, kTickGap = 10.0;
constexpr double kAxisHeight = 60.0, kLegendLine = 26.0, kMinWidth = 560.0, kMinBar = 240.0;
/// Share of the plot's width that the scale bar takes at least.
constexpr double kScaleBarShare = 0.15;

/// A square of the picture: one column of tiles, or several by several.
struct Cell {
  bool has_tiles = false;
  double num_points = 0.0;  ///< per column
  TrainingState state = TrainingState::kTrained;
};

/// The columns in a rectangle of cells, row by row upwards.
class Cells {
 public:
  explicit Cells(const MapFromAbove& map) {
    std::int64_t x1 = INT64_MIN, y1 = INT64_MIN;
    x0_ = y0_ = INT64_MAX;
    for (const TileColumn& column : map.columns) {
      x0_ = std::min<std::int64_t>(x0_, column.x);
      y0_ = std::min<std::int64_t>(y0_, column.y);
      x1 = std::max<std::int64_t>(x1, column.x);
      y1 = std::max<std::int64_t>(y1, column.y);
    }
    const std::int64_t longer = std::max(x1 - x0_, y1 - y0_) + 1;
    columns_per_cell_ = (longer + kMaxCells - 1) / kMaxCells;
    width_ = static_cast<int>((x1 - x0_) / columns_per_cell_) + 1;
    height_ = static_cast<int>((y1 - y0_) / columns_per_cell_) + 1;
    cells_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
    for (const TileColumn& column : map.columns) add(column);
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] std::int64_t columns_per_cell() const { return columns_per_cell_; }
  [[nodiscard]] std::int64_t x0() const { return x0_; }  ///< column of the lower left cell
  [[nodiscard]] std::int64_t y0() const { return y0_; }
  [[nodiscard]] const Cell& at(int i, int j) const {
    return cells_[static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) +
                  static_cast<std::size_t>(i)];
  }
  [[nodiscard]] const std::vector<Cell>& all() const { return cells_; }

 private:
  void add(const TileColumn& column) {
    const auto i = static_cast<std::size_t>((column.x - x0_) / columns_per_cell_);
    const auto j = static_cast<std::size_t>((column.y - y0_) / columns_per_cell_);
    Cell& cell = cells_[j * static_cast<std::size_t>(width_) + i];
    const auto columns = static_cast<double>(columns_per_cell_ * columns_per_cell_);
    cell.num_points += static_cast<double>(column.num_points) / columns;
    cell.state = cell.has_tiles ? std::max(cell.state, column.state) : column.state;
    cell.has_tiles = true;
  }

  std::int64_t x0_, y0_, columns_per_cell_ = 1;
  int width_ = 0, height_ = 0;
  std::vector<Cell> cells_;
};

ChartAxis points_axis(const Cells& cells) {
  std::vector<double> counts;
  for (const Cell& cell : cells.all()) {
    if (cell.num_points > 0.0) counts.push_back(cell.num_points);
  }
  if (counts.empty()) counts.push_back(1.0);
  return decades_around("points per column of tiles", counts);
}

double widest_tick(const ChartAxis& axis) {
  double widest = 0.0;
  for (const double tick : axis.ticks()) {
    widest = std::max(widest, text_width(axis.label_of_tick(tick), kFont));
  }
  return widest;
}

/// Stripes over a colour, by the place of a pixel: they tell states apart without colour.
Color striped(const Color& color, TrainingState state, int x, int y, double period) {
  const auto cover = [&]() {
    switch (state) {
      case TrainingState::kTrained:
        break;
      case TrainingState::kPoor:
        return stripe(y, period);
      case TrainingState::kStale:
        return stripe(x - y, period);
      case TrainingState::kUntrained:
        return std::max(stripe(x + y, period), stripe(x - y, period));
    }
    return 0.0;
  };
  return mix(color, is_dark(color) ? kWhite : kBlack, kStripeOpacity * cover());
}

/// One entry of the legend and whether any cell shows it.
struct LegendItem {
  std::string text;
  Color color;
  TrainingState state;
};

std::vector<LegendItem> legend_of(const Cells& cells) {
  const Color some = color_at(0.45);
  const std::array<LegendItem, 4> states = {
      {{"trained", some, TrainingState::kTrained},
       {"with poor or failed cubes", some, TrainingState::kPoor},
       {"stale: run gdfmap train", some, TrainingState::kStale},
       {"not trained", some, TrainingState::kUntrained}}};
  std::vector<LegendItem> items;
  for (const LegendItem& item : states) {
    if (std::ranges::any_of(cells.all(), [&](const Cell& cell) {
          const bool is_shown = cell.num_points > 0.0 || cell.state != TrainingState::kTrained;
          return cell.has_tiles && is_shown && cell.state == item.state;
        })) {
      items.push_back(item);
    }
  }
  if (std::ranges::any_of(
          cells.all(), [](const Cell& cell) { return cell.has_tiles && cell.num_points == 0.0; })) {
    items.push_back({"cubes without points", kNoPoints, TrainingState::kTrained});
  }
  return items;
}

/// Draws one map, part by part.
class MapFigure {
 public:
  explicit MapFigure(const MapFromAbove& map)
      : cells_(map),
        cell_edge_(map.tile_edge * static_cast<double>(cells_.columns_per_cell())),
        pixels_(
            std::clamp(kPlotSide / std::max(cells_.width(), cells_.height()), 1, kMaxCellPixels)),
        plot_{kLeft, kTop, static_cast<double>(cells_.width() * pixels_),
              static_cast<double>(cells_.height() * pixels_)},
        points_(points_axis(cells_)),
        legend_(legend_of(cells_)),
        tile_edge_(map.tile_edge),
        x_{"x [m]", map.tile_edge * static_cast<double>(cells_.x0()),
           map.tile_edge * static_cast<double>(cells_.x0()) + cell_edge_ * cells_.width()},
        y_{"y [m]", map.tile_edge * static_cast<double>(cells_.y0()),
           map.tile_edge * static_cast<double>(cells_.y0()) + cell_edge_ * cells_.height()},
        bar_label_x_(plot_.right() + kBarGap + kBarWidth + kTickGap + widest_tick(points_) + kFont),
        bar_height_(std::max(plot_.height, kMinBar)),
        legend_top_(std::max(plot_.bottom() + kAxisHeight, plot_.y + bar_height_ + kFont)),
        canvas_(
            static_cast<int>(std::max(kMinWidth, bar_label_x_ + 1.5 * kFont)),
            static_cast<int>(legend_top_ + kLegendLine * static_cast<double>(legend_.size() + 1))) {
  }

  Bytes draw() {
    paint_cells();
    Chart(canvas_, plot_, kFont, x_, y_).draw_axes("");
    draw_points_bar();
    draw_legend();
    return canvas_.png();
  }

 private:
  [[nodiscard]] Color color_of(const Cell& cell) const {
    return cell.num_points > 0.0 ? color_at(points_.share(cell.num_points)) : kNoPoints;
  }

  void paint_cells() {
    const double period = hatch_period(kFont);
    const auto color = [&](int x, int y) {
      const Cell& cell = cells_.at(x / pixels_, cells_.height() - 1 - y / pixels_);
      if (!cell.has_tiles) return kWhite;
      return striped(color_of(cell), cell.state, x, y, period);
    };
    canvas_.fill_pixels(static_cast<int>(plot_.x), static_cast<int>(plot_.y),
                        static_cast<int>(plot_.width), static_cast<int>(plot_.height), color);
  }

  void draw_points_bar() {
    const Rectangle bar{plot_.right() + kBarGap, plot_.y, kBarWidth, bar_height_};
    const auto height = static_cast<int>(bar.height);
    canvas_.fill_pixels(static_cast<int>(bar.x), static_cast<int>(bar.y),
                        static_cast<int>(bar.width), height,
                        [&](int, int y) { return color_at(1.0 - (y + 0.5) / height); });
    canvas_.stroke_rectangle(bar, {kBlack, 1.0});
    for (const double tick : points_.ticks()) {
      const double y = bar.bottom() - points_.share(tick) * bar.height;
      canvas_.stroke_line(std::array{Point{bar.right(), y}, Point{bar.right() + 6.0, y}},
                          {kBlack, 1.0});
      canvas_.text(points_.label_of_tick(tick), {bar.right() + kTickGap, y}, {kFont});
    }
    TextStyle upright{kFont, kBlack, Align::kCentre, -0.5 * std::numbers::pi};
    canvas_.text(points_.label + (cells_.columns_per_cell() > 1 ? ", mean" : ""),
                 {bar_label_x_, bar.y + 0.5 * bar.height}, upright);
  }

  /// Below the axes: the scale bar, then a line for each thing that is shown.
  void draw_legend() {
    double y = legend_top_ + 0.5 * kLegendLine;
    const double pixels_per_metre = pixels_ / cell_edge_;
    const double length = round_step(kScaleBarShare * plot_.width / pixels_per_metre);
    const double end = plot_.x + length * pixels_per_metre;
    canvas_.stroke_line(std::array{Point{plot_.x, y}, Point{end, y}}, {kBlack, 5.0});
    canvas_.text(
        label_of(length, length) + " m; a tile is " + label_of(tile_edge_, tile_edge_) + " m long",
        {end + 12.0, y}, {kFont});
    for (const LegendItem& item : legend_) {
      y += kLegendLine;
      draw_swatch(item, {std::floor(plot_.x), std::floor(y - 9.0), 40.0, 18.0});
      canvas_.text(item.text, {plot_.x + 52.0, y}, {kFont});
    }
  }

  void draw_swatch(const LegendItem& item, const Rectangle& swatch) {
    const double period = hatch_period(kFont);
    canvas_.fill_pixels(
        static_cast<int>(swatch.x), static_cast<int>(swatch.y), static_cast<int>(swatch.width),
        static_cast<int>(swatch.height),
        [&](int x, int y) { return striped(item.color, item.state, x, y, period); });
    canvas_.stroke_rectangle(swatch, {kBlack, 0.7});
  }

  Cells cells_;
  double cell_edge_;  ///< metres
  int pixels_;        ///< along a cell
  Rectangle plot_;
  ChartAxis points_;
  std::vector<LegendItem> legend_;
  double tile_edge_;
  ChartAxis x_, y_;
  double bar_label_x_, bar_height_, legend_top_;
  Canvas canvas_;
};

}  // namespace
}  // namespace drawing

void draw_from_above(const MapFromAbove& map, const std::filesystem::path& png) {
  if (map.columns.empty()) {
    throw Error(ErrorCode::kUsage, "nothing to draw: the map holds neither points nor cubes");
  }
  const Bytes bytes = drawing::MapFigure(map).draw();
  AtomicFile file(png);
  file.write(bytes);
  file.commit();
}

}  // namespace gdfmap
