#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "evaluation_samples.hpp"

namespace gdfmap {

/// The gradient at a sample against the exact field's, see ErrorStatistics.
struct GradientJudgement {
  bool is_judged = false;
  bool is_nan = false;
  bool is_off_axis = false;  ///< away from the medial axis
  float norm = 0.0f;
  float angle_deg = 0.0f;
};

/// Judges the gradient of every n-th answer, since each takes twelve more exact distances.
class GradientJudge {
 public:
  /// Both outlive it. @param stride  n
  GradientJudge(EvaluationTruth& truth, std::uint64_t stride) : truth_(truth), stride_(stride) {}

  [[nodiscard]] std::vector<GradientJudgement> judge(std::span<const EvaluationSample> samples,
                                                     std::span<const FieldSample> answers);

 private:
  EvaluationTruth& truth_;
  std::uint64_t stride_;
  std::uint64_t num_samples_ = 0;
};

}  // namespace gdfmap
