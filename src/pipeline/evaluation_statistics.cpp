#include "evaluation_statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace gdfmap {
namespace {

using Band = std::pair<double, double>;
constexpr std::array<Band, kBandLimits.size() - 1> bands_between_limits() {
  std::array<Band, kBandLimits.size() - 1> bands;
  for (std::size_t i = 0; i < bands.size(); ++i) bands[i] = {kBandLimits[i], kBandLimits[i + 1]};
  return bands;
}
constexpr auto kBands = bands_between_limits();
/// Where angles near surfaces are told apart.
constexpr std::array<Band, 2> kGradientBands = {{{0.1, 0.3}, {0.3, 1.0}}};

/// Mean and standard deviation of weighted numbers that arrive one by one (West 1979).
class Moments {
 public:
  void add(double value, double weight) {
    weight_ += weight;
    const double delta = value - mean_;
    mean_ += delta * weight / weight_;
    squares_ += weight * delta * (value - mean_);
  }
  [[nodiscard]] double mean() const { return mean_; }
  [[nodiscard]] double deviation() const {
    return weight_ > 0.0 ? std::sqrt(squares_ / weight_) : 0.0;
  }

 private:
  double weight_ = 0.0, mean_ = 0.0, squares_ = 0.0;
};

/// Weighted numbers of which percentiles are wanted.
class Distribution {
 public:
  void add(float value, float weight) {
    values_.emplace_back(value, weight);
    total_ += static_cast<double>(weight);
  }
  void sort() { std::sort(values_.begin(), values_.end()); }
  /// The least value that is not exceeded by `share` of the weight; after sort(), of one or more.
  [[nodiscard]] double percentile(double share) const {
    double sum = 0.0;
    for (const auto& [value, weight] : values_) {
      sum += static_cast<double>(weight);
      if (sum >= share * total_) return static_cast<double>(value);
    }
    return static_cast<double>(values_.back().first);
  }

 private:
  std::vector<std::pair<float, float>> values_;
  double total_ = 0.0;
};

void set_error_figures(std::span<const JudgedRecord* const> group, ErrorStatistics& result) {
  if (group.empty()) return;
  Distribution errors, relative;
  Moments mean, square, own_cube, expected;
  for (const JudgedRecord* const record : group) {
    const auto error = static_cast<double>(record->error);
    const auto weight = static_cast<double>(record->weight);
    errors.add(record->error, record->weight);
    relative.add(record->error / std::max(record->distance, 1e-6f), record->weight);
    mean.add(error, weight);
    square.add(error * error, weight);
    own_cube.add(static_cast<double>(record->own_cube_error), weight);
    expected.add(static_cast<double>(record->expected_error), weight);
  }
  errors.sort();
  relative.sort();
  result.mae = mean.mean();
  result.rmse = std::sqrt(square.mean());
  result.median = errors.percentile(0.5);
  result.p95 = errors.percentile(0.95);
  result.max = errors.percentile(1.0);
  result.relative_p95 = relative.percentile(0.95);
  result.own_cube_mae = own_cube.mean();
  result.expected_error = expected.mean();
}

void set_gradient_figures(std::span<const JudgedRecord* const> group, ErrorStatistics& result) {
  Moments norm, angle, off_axis_norm, off_axis_angle;
  for (const JudgedRecord* const record : group) {
    const GradientJudgement& gradient = record->gradient;
    if (!gradient.is_judged) continue;
    ++result.num_gradients;
    if (gradient.is_nan) {
      ++result.num_nan_gradients;
      continue;
    }
    const auto weight = static_cast<double>(record->weight);
    norm.add(static_cast<double>(gradient.norm), weight);
    angle.add(static_cast<double>(gradient.angle_deg), weight);
    if (!gradient.is_off_axis) continue;
    ++result.num_off_axis_gradients;
    off_axis_norm.add(static_cast<double>(gradient.norm), weight);
    off_axis_angle.add(static_cast<double>(gradient.angle_deg), weight);
  }
  result.gradient_norm_mean = norm.mean();
  result.gradient_norm_std = norm.deviation();
  result.gradient_angle_mean_deg = angle.mean();
  result.off_axis_norm_mean = off_axis_norm.mean();
  result.off_axis_norm_std = off_axis_norm.deviation();
  result.off_axis_angle_mean_deg = off_axis_angle.mean();
}

RecordFilter within(const Band& band, const RecordFilter& also) {
  return [band, also](const JudgedRecord& record) {
    const auto distance = static_cast<double>(record.distance);
    return distance >= band.first && distance < band.second && also(record);
  };
}

std::vector<BandStatistics> band_statistics(std::span<const JudgedRecord> records,
                                            std::span<const Band> bands, const RecordFilter& also) {
  std::vector<BandStatistics> result;
  for (const Band& band : bands) {
    result.push_back({band.first, band.second, error_statistics(records, within(band, also))});
  }
  return result;
}

AnswerCounts count_answers(std::span<const JudgedRecord> records, const RecordFilter& filter) {
  AnswerCounts counts;
  for (const JudgedRecord& record : records) {
    if (filter(record)) counts.add(record.status);
  }
  return counts;
}

double stated_share(std::span<const JudgedRecord> records) {
  Moments share;
  for (const JudgedRecord& record : records) {
    if (static_cast<double>(record.distance) >= kMaxJudgedDistance) continue;
    share.add(record.is_stated() ? 1.0 : 0.0, static_cast<double>(record.weight));
  }
  return share.mean();
}

bool any(const JudgedRecord&) { return true; }

RecordFilter of_level(int level) {
  return [level](const JudgedRecord& record) { return record.level == level; };
}

}  // namespace

void AnswerCounts::add(FieldStatus status) {
  switch (status) {
    case FieldStatus::kFine:
      ++num_fine;
      return;
    case FieldStatus::kCoarse:
      ++num_coarse;
      return;
    case FieldStatus::kFar:
      ++num_far;
      return;
    case FieldStatus::kUnknown:
    case FieldStatus::kPending:
      break;
  }
  ++num_unknown;
}

ErrorStatistics error_statistics(std::span<const JudgedRecord> records,
                                 const RecordFilter& filter) {
  std::vector<const JudgedRecord*> group;
  for (const JudgedRecord& record : records) {
    if (record.is_stated() && filter(record)) group.push_back(&record);
  }
  ErrorStatistics result;
  result.num_samples = group.size();
  set_error_figures(group, result);
  set_gradient_figures(group, result);
  return result;
}

Evaluation summarize(std::span<const JudgedRecord> records, std::span<const int> levels) {
  Evaluation result;
  result.all = error_statistics(records, of_level(0));
  result.populated = error_statistics(
      records, [](const JudgedRecord& r) { return r.level == 0 && r.is_populated; });
  result.empty = error_statistics(
      records, [](const JudgedRecord& r) { return r.level == 0 && !r.is_populated; });
  result.outer_shell = error_statistics(
      records, [](const JudgedRecord& r) { return r.level == 0 && r.is_outer_shell; });
  for (const int level : levels) {
    const RecordFilter here = of_level(level);
    result.levels.push_back({level, count_answers(records, here), error_statistics(records, here),
                             band_statistics(records, kBands, here)});
  }
  result.bands = band_statistics(records, kBands, any);
  result.gradient_bands = band_statistics(records, kGradientBands, any);
  result.answers = count_answers(records, any);
  result.beyond = count_answers(records, of_level(kNoLevel));
  result.stated_share = stated_share(records);
  return result;
}

}  // namespace gdfmap
