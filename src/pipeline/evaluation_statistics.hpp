#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include <gdfmap/pipeline/evaluate.hpp>

#include "evaluation_gradients.hpp"

namespace gdfmap {

/// What is kept of a judged sample until all are there.
struct JudgedRecord {
  float error = 0.0f;           ///< metres
  float own_cube_error = 0.0f;  ///< metres
  float expected_error = 0.0f;  ///< metres
  float distance = 0.0f;        ///< metres
  float weight = 1.0f;
  GradientJudgement gradient;
  std::int8_t level = kNoLevel;
  FieldStatus status = FieldStatus::kUnknown;
  bool is_populated = false, is_outer_shell = false;

  [[nodiscard]] bool is_stated() const {
    return status == FieldStatus::kFine || status == FieldStatus::kCoarse;
  }
};

/// Says whether a record belongs to a group.
using RecordFilter = std::function<bool(const JudgedRecord&)>;

/// Statistics of the stated answers of a group.
[[nodiscard]] ErrorStatistics error_statistics(std::span<const JudgedRecord> records,
                                               const RecordFilter& filter);

/// Everything but num_set_aside. @param levels  those that have cubes
[[nodiscard]] Evaluation summarize(std::span<const JudgedRecord> records,
                                   std::span<const int> levels);

}  // namespace gdfmap
