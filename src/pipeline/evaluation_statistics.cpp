#include "evaluation_statistics.hpp"

#include <algorithm>
#include <cmath>

namespace gdfmap {
namespace {

/// Mean and standard deviation of numbers that arrive one by one (Welford 1962).
class Moments {
 public:
  void add(double value) {
    ++count_;
    const double delta = value - mean_;
    mean_ += delta / static_cast<double>(count_);
    squares_ += delta * (value - mean_);
  }
  [[nodiscard]] double mean() const { return mean_; }
  [[nodiscard]] double deviation() const {
    return count_ > 0 ? std::sqrt(squares_ / static_cast<double>(count_)) : 0.0;
  }

 private:
  std::uint64_t count_ = 0;
  double mean_ = 0.0, squares_ = 0.0;
};

}  // namespace

void StatisticsCollector::add(double error, const std::optional<GradientJudgement>& gradient) {
  errors_.push_back(static_cast<float>(error));
  if (gradient) gradients_.push_back(*gradient);
}

ErrorStatistics StatisticsCollector::statistics() const {
  ErrorStatistics result;
  result.num_samples = errors_.size();
  if (!errors_.empty()) {
    std::vector<float> sorted = errors_;
    std::sort(sorted.begin(), sorted.end());
    double sum = 0.0, squares = 0.0;
    for (const float error : sorted) {
      sum += error;
      squares += static_cast<double>(error) * error;
    }
    const auto count = static_cast<double>(sorted.size());
    result.mae = sum / count;
    result.rmse = std::sqrt(squares / count);
    result.median = sorted[sorted.size() / 2];
    result.p95 = sorted[(sorted.size() * 95 + 99) / 100 - 1];
    result.max = sorted.back();
  }
  Moments norm, angle, off_axis_norm, off_axis_angle;
  for (const GradientJudgement& gradient : gradients_) {
    ++result.num_gradients;
    if (gradient.is_nan) {
      ++result.num_nan_gradients;
      continue;
    }
    norm.add(gradient.norm);
    angle.add(gradient.angle_deg);
    if (!gradient.off_axis) continue;
    off_axis_norm.add(gradient.norm);
    off_axis_angle.add(gradient.angle_deg);
  }
  result.gradient_norm_mean = norm.mean();
  result.gradient_norm_std = norm.deviation();
  result.gradient_angle_mean_deg = angle.mean();
  result.off_axis_norm_mean = off_axis_norm.mean();
  result.off_axis_norm_std = off_axis_norm.deviation();
  result.off_axis_angle_mean_deg = off_axis_angle.mean();
  return result;
}

}  // namespace gdfmap
