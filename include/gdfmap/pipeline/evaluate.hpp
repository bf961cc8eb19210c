#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <gdfmap/core/run_context.hpp>
#include <gdfmap/query/distance_field.hpp>

namespace gdfmap {

/// What a field is compared with, and where.
struct EvaluateOptions {
  std::filesystem::path cloud;  ///< empty: the map's own points
  std::string truth_scene;      ///< analytic scene instead of a cloud; empty: none
  double truth_size = 0.0;      ///< metres; 0: the scene's default
  /// With an analytic scene, on a map that has points: samples whose exact nearest-point distance
  /// differs from the analytic one by more than this (metres) are set aside and counted, since no
  /// method could know better from the points.
  double truth_gap = 0.005;
  std::uint64_t num_samples = 100'000;  ///< random samples, uniform over the cubes' boxes
  std::uint64_t seed = 1;
  std::optional<double> step;  ///< metres: the ancestor's regular samples of every cube instead
  BlendMode blend = BlendMode::kPartition;
};

/// Errors of a set of samples: |d̂ − d|, metres. Gradients are judged where the true distance
/// exceeds 0.1 m, as the ancestor's evaluator does.
struct ErrorStatistics {
  std::uint64_t num_samples = 0;
  double mae = 0.0, median = 0.0, rmse = 0.0, p95 = 0.0, max = 0.0;
  std::uint64_t num_gradients = 0;
  std::uint64_t num_nan_gradients = 0;
  double gradient_norm_mean = 0.0, gradient_norm_std = 0.0;
  double gradient_angle_mean_deg = 0.0;  ///< to the true direction
  /// The same norm over samples off the medial axis, where the true field has one.
  double off_axis_norm_mean = 0.0, off_axis_norm_std = 0.0;
  double off_axis_angle_mean_deg = 0.0;
};

/// Statistics of the samples whose true distance lies in [min_distance, max_distance).
struct BandStatistics {
  double min_distance = 0.0, max_distance = 0.0;
  ErrorStatistics errors;
};

struct Evaluation {
  ErrorStatistics all;          ///< over kFine and kCoarse answers
  ErrorStatistics populated;    ///< in cubes that hold points
  ErrorStatistics empty;        ///< in cubes that hold none
  ErrorStatistics outer_shell;  ///< in cubes that lack a neighbour
  std::vector<BandStatistics> bands;
  std::uint64_t num_fine = 0, num_coarse = 0, num_far = 0, num_unknown = 0;
  std::uint64_t num_set_aside = 0;   ///< see truth_gap
  double mean_expected_error = 0.0;  ///< as the field states it, over the samples of `all`
};

/// Compares the field of a map or model file with exact distances. Out of core: samples are looked
/// up tile by tile; a cloud other than the map's own is first ingested into a temporary store
/// beside the system's temporary files.
/// @throws Error kUsage when there is nothing to compare with; what the parts throw.
[[nodiscard]] Evaluation evaluate(const std::filesystem::path& map_or_model,
                                  const EvaluateOptions& options, const RunContext& context = {});

}  // namespace gdfmap
