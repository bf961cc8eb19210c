#include <algorithm>
#include <array>
#include <cmath>

#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/error_plot.hpp>

#include "drawing/chart.hpp"
#include "drawing/ticks.hpp"

namespace gdfmap {
namespace {

using drawing::Chart;
using drawing::ChartAxis;
using drawing::ChartEntry;
using drawing::Color;
using drawing::Point;
using drawing::Rectangle;
using drawing::Stroke;

constexpr double kBinsPerDecade = 20.0;
constexpr double kLeastError = 1e-6;  ///< metres; smaller ones stand in the first bin
constexpr double kLeastDistance = 1e-2;
constexpr double kDistanceBinsPerDecade = 6.0;
/// Of a bin with fewer samples no percentile is drawn.
constexpr std::uint64_t kLeastSamples = 20;
/// Bins with less of a level's space than this do not stretch the axis.
constexpr double kLeastShare = 2e-3;

// Pixels.
constexpr int kWidth = 1240, kHeight = 545;
constexpr double kFont = 15.0;
constexpr Rectangle kHistogramPlot{90.0, 70.0, 500.0, 400.0};
constexpr Rectangle kDistancePlot{710.0, 70.0, 500.0, 400.0};

/// Lines differ in lightness and in their dashes, for grey print.
struct LevelStyle {
  Color color;
  double dash;
};
LevelStyle style_of(int level) {
  constexpr std::array<double, 3> kDashes = {0.0, 8.0, 3.0};
  const auto i = static_cast<std::size_t>(std::clamp(level, 0, 2));
  return {drawing::color_at(0.1 + 0.25 * static_cast<double>(i)), kDashes[i]};
}

Stroke line(const Color& color, double dash) { return {color, 2.2, 1.0, dash}; }

/// The outline of a histogram: error against share of the level's space in percent.
std::vector<Point> steps(const ErrorPlot::Histogram& histogram) {
  std::vector<Point> points;
  const std::vector<double>& weights = histogram.weights();
  for (std::size_t bin = 0; bin < weights.size(); ++bin) {
    const double share = 100.0 * weights[bin] / histogram.total();
    points.push_back({ErrorPlot::Histogram::bin_begin(bin), share});
    points.push_back({ErrorPlot::Histogram::bin_begin(bin + 1), share});
  }
  return points;
}

void draw_histogram(drawing::Canvas& canvas, const std::map<int, ErrorPlot::Histogram>& by_level) {
  std::vector<double> shown;
  double highest = 0.0;
  for (const auto& [level, histogram] : by_level) {
    for (std::size_t bin = 0; bin < histogram.weights().size(); ++bin) {
      const double share = histogram.weights()[bin] / histogram.total();
      highest = std::max(highest, 100.0 * share);
      if (share < kLeastShare) continue;
      shown.push_back(ErrorPlot::Histogram::bin_begin(bin));
      shown.push_back(ErrorPlot::Histogram::bin_begin(bin + 1));
    }
  }
  Chart chart(canvas, kHistogramPlot, kFont, drawing::decades_around("error [m]", shown),
              {"share of the space [%]", 0.0, drawing::round_end(1.1 * highest), false});
  chart.draw_grid();
  std::vector<ChartEntry> entries;
  for (const auto& [level, histogram] : by_level) {
    const LevelStyle style = style_of(level);
    if (level == 0) chart.draw_area(steps(histogram), mix(style.color, drawing::kWhite, 0.7));
    chart.draw_line(steps(histogram), line(style.color, style.dash));
    entries.push_back({"level " + std::to_string(level), line(style.color, style.dash)});
  }
  chart.draw_legend(entries);
  chart.draw_axes("how much of the space has which error");
}

void draw_by_distance(drawing::Canvas& canvas,
                      const std::map<int, ErrorPlot::Histogram>& by_distance) {
  std::vector<Point> median, mean, p95;
  std::vector<double> distances, errors;
  for (const auto& [bin, histogram] : by_distance) {
    if (histogram.num_samples() < kLeastSamples) continue;
    const double distance = std::pow(10.0, (bin + 0.5) / kDistanceBinsPerDecade);
    distances.push_back(distance);
    median.push_back({distance, histogram.percentile(0.5)});
    mean.push_back({distance, histogram.mean()});
    p95.push_back({distance, histogram.percentile(0.95)});
    for (const double error : {median.back().y, mean.back().y, p95.back().y}) {
      errors.push_back(std::max(error, kLeastError));
    }
  }
  if (distances.empty()) return;
  Chart chart(canvas, kDistancePlot, kFont,
              drawing::decades_around("distance to the nearest point [m]", distances),
              drawing::decades_around("error [m]", errors));
  chart.draw_grid();
  const std::array<ChartEntry, 3> entries = {
      {{"95th percentile", line(drawing::color_at(0.7), 3.0)},
       {"mean", line(drawing::color_at(0.4), 8.0)},
       {"median", line(drawing::color_at(0.1), 0.0)}}};
  chart.draw_line(p95, entries[0].stroke);
  chart.draw_line(mean, entries[1].stroke);
  chart.draw_line(median, entries[2].stroke);
  chart.draw_legend(entries);
  chart.draw_axes("error against distance");
}

}  // namespace

void ErrorPlot::Histogram::add(double error, double weight) {
  const double place = kBinsPerDecade * std::log10(std::max(error, kLeastError) / kLeastError);
  weights_[std::min(static_cast<std::size_t>(place), kNumBins - 1)] += weight;
  total_ += weight;
  sum_ += weight * error;
  ++num_samples_;
}

double ErrorPlot::Histogram::bin_begin(std::size_t bin) {
  return kLeastError * std::pow(10.0, static_cast<double>(bin) / kBinsPerDecade);
}

double ErrorPlot::Histogram::percentile(double share) const {
  double sum = 0.0;
  for (std::size_t bin = 0; bin < kNumBins; ++bin) {
    if (sum + weights_[bin] >= share * total_ && weights_[bin] > 0.0) {
      const double within = std::clamp((share * total_ - sum) / weights_[bin], 0.0, 1.0);
      return bin_begin(bin) * std::pow(10.0, within / kBinsPerDecade);
    }
    sum += weights_[bin];
  }
  return bin_begin(kNumBins);
}

void ErrorPlot::add(std::span<const JudgedSample> samples) {
  for (const JudgedSample& sample : samples) {
    if (!sample.is_stated()) continue;
    by_level_[sample.level].add(sample.error(), sample.weight);
    const double place =
        kDistanceBinsPerDecade * std::log10(std::max(sample.distance, kLeastDistance));
    by_distance_[static_cast<int>(std::floor(place))].add(sample.error(), sample.weight);
  }
}

void ErrorPlot::write(const std::filesystem::path& png) const {
  if (by_level_.empty()) {
    throw Error(ErrorCode::kUsage, "nothing to draw: the field states no distance anywhere");
  }
  drawing::Canvas canvas(kWidth, kHeight);
  draw_histogram(canvas, by_level_);
  draw_by_distance(canvas, by_distance_);
  AtomicFile file(png);
  file.write(canvas.png());
  file.commit();
}

}  // namespace gdfmap
