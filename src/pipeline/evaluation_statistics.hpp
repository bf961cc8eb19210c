#pragma once

#include <optional>
#include <vector>

#include <gdfmap/pipeline/evaluate.hpp>

namespace gdfmap {

/// The gradient at a sample against the exact field's.
struct GradientJudgement {
  bool is_nan = false;
  double norm = 0.0;
  double angle_deg = 0.0;
  bool off_axis = false;  ///< away from the medial axis
};

/// Collects samples of one group.
class StatisticsCollector {
 public:
  void add(double error, const std::optional<GradientJudgement>& gradient);
  [[nodiscard]] ErrorStatistics statistics() const;

 private:
  std::vector<float> errors_;
  std::vector<GradientJudgement> gradients_;
};

}  // namespace gdfmap
