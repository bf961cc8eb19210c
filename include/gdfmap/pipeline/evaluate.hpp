#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <gdfmap/core/run_context.hpp>
#include <gdfmap/query/distance_field.hpp>

namespace gdfmap {

/// Stands for a level where a place lies in no cube of any.
inline constexpr int kNoLevel = -1;

/// One place where a field was judged.
struct JudgedSample {
  Vector3 p_world;
  double distance = 0.0;  ///< the true one, metres
  double weight = 0.0;    ///< volume that it stands for, m³
  int level = kNoLevel;   ///< finest level that has a cube here
  FieldSample answer;

  /// Whether the field states a distance, rather than a bound or nothing.
  [[nodiscard]] bool is_stated() const {
    return answer.status == FieldStatus::kFine || answer.status == FieldStatus::kCoarse;
  }
  [[nodiscard]] double error() const { return std::abs(answer.distance - distance); }  ///< metres
};

/// What a field is compared with, and where.
struct EvaluateOptions {
  std::filesystem::path cloud;  ///< empty: the map's own points
  std::string truth_scene;      ///< analytic scene instead of a cloud; empty: none
  double truth_size = 0.0;      ///< metres; 0: the scene's default
  /// With an analytic scene, on a map that has points: samples whose exact nearest-point distance
  /// differs from the analytic one by more than this (metres) are set aside and counted, since no
  /// method could know better from the points.
  double truth_gap = 0.005;
  std::uint64_t num_samples = 100'000;  ///< random samples, see evaluate()
  std::uint64_t seed = 1;
  std::optional<double> step;  ///< metres: the ancestor's regular samples of every cube instead
  BlendMode blend = BlendMode::kPartition;
  /// Called with every judged sample, in pieces, in an order that depends on the samples alone.
  std::function<void(std::span<const JudgedSample>)> visit;
};

/// Errors of a group of samples: |d̂ − d|, metres. Means, deviations and percentiles are those of
/// the space that the samples stand for.
///
/// Gradients are judged where the true distance exceeds 0.1 m, as by the ancestor's evaluator. The
/// angle is that to the direction away from the nearest point: central differences of the exact
/// distance over ± 1/512 of an edge. A sample is off the medial axis where the same differences
/// over ± 1/10 of an edge have a norm of at least 0.97: nothing within that reach has another
/// nearest side. Edges are those of the cube that holds the sample.
struct ErrorStatistics {
  std::uint64_t num_samples = 0;
  double mae = 0.0, median = 0.0, rmse = 0.0, p95 = 0.0, max = 0.0;
  double relative_p95 = 0.0;    ///< 95th percentile of error / distance
  double own_cube_mae = 0.0;    ///< of the Gaussians of the cube that holds the sample, unblended
  double expected_error = 0.0;  ///< mean of what the field states; NaN where a cube's is unknown
  std::uint64_t num_gradients = 0;
  std::uint64_t num_nan_gradients = 0;
  double gradient_norm_mean = 0.0, gradient_norm_std = 0.0;
  double gradient_angle_mean_deg = 0.0;
  std::uint64_t num_off_axis_gradients = 0;
  double off_axis_norm_mean = 0.0, off_axis_norm_std = 0.0;
  double off_axis_angle_mean_deg = 0.0;
};

/// Statistics of the samples whose true distance lies in [min_distance, max_distance).
struct BandStatistics {
  double min_distance = 0.0, max_distance = 0.0;
  ErrorStatistics errors;
};

/// How many samples got which answer.
struct AnswerCounts {
  std::uint64_t num_fine = 0, num_coarse = 0, num_far = 0, num_unknown = 0;

  void add(FieldStatus status);
  [[nodiscard]] std::uint64_t total() const {
    return num_fine + num_coarse + num_far + num_unknown;
  }
  bool operator==(const AnswerCounts&) const = default;
};

/// Samples in cubes of one level that lie in none of a finer level.
struct LevelStatistics {
  int level = 0;
  AnswerCounts answers;
  ErrorStatistics errors;
  std::vector<BandStatistics> bands;
};

/// Errors are those of answers that state a distance (kFine, kCoarse); a far bound is no estimate.
struct Evaluation {
  ErrorStatistics all;                  ///< in cubes of level 0, whatever other levels there are
  ErrorStatistics populated;            ///< of these, in cubes that hold points
  ErrorStatistics empty;                ///< of these, in cubes that hold none
  ErrorStatistics outer_shell;          ///< of these, in cubes that lack a neighbour
  std::vector<LevelStatistics> levels;  ///< one for each level that has cubes
  std::vector<BandStatistics> bands;    ///< of all levels; they share no sample
  std::vector<BandStatistics>
      gradient_bands;               ///< of all levels, for the angle; they overlap `bands`
  AnswerCounts answers;             ///< to all samples
  AnswerCounts beyond;              ///< to samples within kMaxJudgedDistance that lie in no cube
  double stated_share = 0.0;        ///< of the space within kMaxJudgedDistance of the points
  std::uint64_t num_set_aside = 0;  ///< see truth_gap
};

/// Places farther from the truth (metres) are judged inside cubes of level 0 alone.
inline constexpr double kMaxJudgedDistance = 30.0;

/// Compares the field of a map or model file with exact distances.
///
/// Random samples are stratified: the cubes of every level where no finer one has any, and what
/// lies in no cube within kMaxJudgedDistance of the truth, are each divided by distance (0, 0.1,
/// 0.5, 2, 10, 30 m), and every part gets an equal number of samples, as far as it has room. They
/// are uniform in their part and weighted by its volume, and a pure function of the seed, the
/// points and the list of cubes. Regular samples (`step`), and those of the ancestor's blending,
/// lie in cubes of level 0 alone.
///
/// Out of core, but for at most 300 bytes a sample; a cloud other than the map's own is first
/// ingested into a temporary store in the system's directory for temporary files.
/// @throws Error kUsage when there is nothing to compare with, or for more samples than half the
///         memory budget holds; what the parts throw.
[[nodiscard]] Evaluation evaluate(const std::filesystem::path& map_or_model,
                                  const EvaluateOptions& options, const RunContext& context = {});

}  // namespace gdfmap
