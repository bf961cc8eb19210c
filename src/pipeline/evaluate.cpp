#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/evaluate.hpp>
#include <gdfmap/pipeline/field_access.hpp>

#include "evaluation_samples.hpp"
#include "evaluation_statistics.hpp"
#include "evaluation_truth.hpp"

namespace gdfmap {
namespace {

/// Gradients are judged beyond this distance (metres), as by the ancestor's evaluator.
constexpr double kLeastGradientDistance = 0.1;
/// Of more samples than this only every n-th gradient is judged: each takes twelve more distances.
constexpr std::uint64_t kMaxGradients = 200'000;
/// Half widths of the differences of the exact field, in edges: a narrow one for the true
/// direction, a wide one whose norm falls short of 1 where the medial axis is near.
constexpr double kNarrow = 1.0 / 512, kWide = 0.05;
constexpr double kOffAxisNorm = 0.95;
/// Limits of the bands, metres; the last one is open in practice (level 0 reaches a few cubes).
constexpr std::array<double, 6> kBandLimits = {0.0, 0.1, 0.5, 2.0, 10.0, 30.0};

/// Reads the list of judged cubes of a map or a model.
std::vector<JudgedTile> list_tiles(Map* map, const std::filesystem::path& model, bool skip_poor) {
  std::vector<JudgedTile> tiles;
  if (map == nullptr) {
    for (const TileRecord& record : tiles_of_model(read_model(model).cubes)) {
      add_judged_tile(record, skip_poor, tiles);
    }
  } else {
    std::vector<TileKey> keys;
    map->cubes().for_each_state([&](const TileState& state) {
      if (state.key.level == 0 && state.num_cubes > 0) keys.push_back(state.key);
    });
    for (const TileKey& key : keys) {
      if (const auto record = map->cubes().read(key)) add_judged_tile(*record, skip_poor, tiles);
    }
  }
  mark_outer_shell(tiles);
  return tiles;
}

class Evaluator {
 public:
  Evaluator(const DistanceField& field, const Lattice& lattice, EvaluationTruth& truth,
            std::uint64_t gradient_stride)
      : field_(field), lattice_(lattice), truth_(truth), gradient_stride_(gradient_stride) {}

  void judge(const JudgedTile& tile, std::span<const JudgedSample> samples) {
    if (samples.empty()) return;
    std::vector<Vector3> points;
    std::vector<Eigen::Vector3i> places;
    for (const JudgedSample& sample : samples) {
      points.push_back(sample.p_world);
      places.push_back(sample.p_tile);
    }
    std::vector<FieldSample> answers(samples.size());
    field_.at(points, answers);
    const LatticePoint origin = tile_origin(tile.key);
    const std::vector<double> distances = truth_.distances(origin, places);
    const std::vector<bool> told = truth_.is_told_by_points(origin, places, distances);
    const std::vector<std::optional<GradientJudgement>> gradients =
        judge_gradients(origin, places, distances, answers);
    const CubeMask populated = truth_.populated(tile.key).value_or(tile.populated);

    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (!told[i]) {
        ++result_.num_set_aside;
        continue;
      }
      if (!count_status(answers[i].status)) continue;
      const double error = std::abs(answers[i].distance - distances[i]);
      all_.add(error, gradients[i]);
      (populated.test(samples[i].cube) ? populated_ : empty_).add(error, gradients[i]);
      if (tile.outer_shell.test(samples[i].cube)) outer_shell_.add(error, gradients[i]);
      if (StatisticsCollector* band = band_of(distances[i])) band->add(error, gradients[i]);
      expected_error_sum_ += answers[i].expected_error;
    }
  }

  [[nodiscard]] Evaluation result() const {
    Evaluation result = result_;
    result.all = all_.statistics();
    result.populated = populated_.statistics();
    result.empty = empty_.statistics();
    result.outer_shell = outer_shell_.statistics();
    for (std::size_t i = 0; i < bands_.size(); ++i) {
      result.bands.push_back({kBandLimits[i], kBandLimits[i + 1], bands_[i].statistics()});
    }
    if (result.all.num_samples > 0) {
      result.mean_expected_error =
          expected_error_sum_ / static_cast<double>(result.all.num_samples);
    }
    return result;
  }

 private:
  /// Counts an answer; true when it states a distance rather than a bound or nothing.
  bool count_status(FieldStatus status) {
    switch (status) {
      case FieldStatus::kFine:
        ++result_.num_fine;
        return true;
      case FieldStatus::kCoarse:
        ++result_.num_coarse;
        return true;
      case FieldStatus::kFar:
        ++result_.num_far;
        return false;
      case FieldStatus::kUnknown:
      case FieldStatus::kPending:
        break;
    }
    ++result_.num_unknown;
    return false;
  }

  [[nodiscard]] StatisticsCollector* band_of(double distance) {
    const auto limit = std::upper_bound(kBandLimits.begin(), kBandLimits.end(), distance);
    if (limit == kBandLimits.end()) return nullptr;
    return &bands_[static_cast<std::size_t>(limit - kBandLimits.begin() - 1)];
  }

  /// Central differences of the true distance over ± `half_width` edges at each place.
  [[nodiscard]] std::vector<Vector3> true_gradients(const LatticePoint& origin,
                                                    std::span<const Eigen::Vector3i> places,
                                                    double half_width) {
    const int h = static_cast<int>(half_width * kStepsPerCubeAxis);
    std::vector<Eigen::Vector3i> around;
    for (const Eigen::Vector3i& place : places) {
      for (int a = 0; a < 3; ++a) {
        around.push_back(place + h * Eigen::Vector3i::Unit(a));
        around.push_back(place - h * Eigen::Vector3i::Unit(a));
      }
    }
    const std::vector<double> distances = truth_.distances(origin, around);
    std::vector<Vector3> gradients(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      for (std::size_t a = 0; a < 3; ++a) {
        gradients[i][static_cast<Eigen::Index>(a)] =
            (distances[6 * i + 2 * a] - distances[6 * i + 2 * a + 1]) / (2 * h * lattice_.step());
      }
    }
    return gradients;
  }

  [[nodiscard]] std::vector<std::optional<GradientJudgement>> judge_gradients(
      const LatticePoint& origin, std::span<const Eigen::Vector3i> places,
      std::span<const double> distances, std::span<const FieldSample> answers) {
    std::vector<std::size_t> judged;
    std::vector<Eigen::Vector3i> judged_places;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (num_samples_++ % gradient_stride_ != 0 || distances[i] <= kLeastGradientDistance)
        continue;
      judged.push_back(i);
      judged_places.push_back(places[i]);
    }
    const std::vector<Vector3> narrow = true_gradients(origin, judged_places, kNarrow);
    const std::vector<Vector3> wide = true_gradients(origin, judged_places, kWide);
    std::vector<std::optional<GradientJudgement>> result(places.size());
    for (std::size_t j = 0; j < judged.size(); ++j) {
      const Vector3& gradient = answers[judged[j]].gradient;
      GradientJudgement judgement;
      judgement.is_nan = !gradient.allFinite();
      judgement.norm = gradient.norm();
      judgement.angle_deg = std::atan2(gradient.cross(narrow[j]).norm(), gradient.dot(narrow[j])) *
                            180.0 / std::numbers::pi;
      judgement.off_axis = wide[j].norm() >= kOffAxisNorm;
      result[judged[j]] = judgement;
    }
    return result;
  }

  const DistanceField& field_;
  const Lattice& lattice_;
  EvaluationTruth& truth_;
  std::uint64_t gradient_stride_;
  std::uint64_t num_samples_ = 0;
  Evaluation result_;
  StatisticsCollector all_, populated_, empty_, outer_shell_;
  std::array<StatisticsCollector, kBandLimits.size() - 1> bands_;
  double expected_error_sum_ = 0.0;
};

void check(const EvaluateOptions& options, double cube_size) {
  if (options.step && !(*options.step >= cube_size / 1000 && *options.step <= cube_size)) {
    throw Error(ErrorCode::kUsage, "step must be between cube_size / 1000 and cube_size");
  }
}

/// Number of regular samples of a cube.
std::uint64_t samples_per_cube(double step, double edge) {
  const double per_axis = std::ceil(edge / step - 0.5);
  return static_cast<std::uint64_t>(per_axis * per_axis * per_axis);
}

}  // namespace

Evaluation evaluate(const std::filesystem::path& map_or_model, const EvaluateOptions& options,
                    const RunContext& context) {
  std::unique_ptr<Map> map;
  if (std::filesystem::is_directory(map_or_model)) {
    map = std::make_unique<Map>(Map::open(map_or_model, Access::kRead, context));
  }
  const std::shared_ptr<TileSource> source = open_tile_source(map_or_model);
  const Lattice lattice(source->geometry().cube_size);
  check(options, lattice.cube_size());
  const std::vector<JudgedTile> tiles =
      list_tiles(map.get(), map_or_model, options.blend == BlendMode::kGdf1);
  if (tiles.empty()) {
    throw Error(ErrorCode::kUsage, map_or_model.string() + " has no cubes: train it first");
  }
  EvaluationTruth truth(map.get(), lattice, options, context);
  const DistanceField field(source, {context.memory() / 4, options.blend, context.threads()});

  const RandomSampler random(tiles, options.step ? 0 : options.num_samples, options.seed);
  std::uint64_t num_samples = options.num_samples;
  if (options.step) {
    num_samples = 0;
    for (const JudgedTile& tile : tiles)
      num_samples += static_cast<std::uint64_t>(tile.cubes.count());
    num_samples *= samples_per_cube(*options.step, lattice.cube_size());
  }
  Evaluator evaluator(field, lattice, truth, num_samples / kMaxGradients + 1);
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    context.throw_if_stopped();
    evaluator.judge(tiles[i], options.step ? regular_samples(tiles[i], *options.step, lattice)
                                           : random.samples(i, lattice));
    context.progress({"tiles", i + 1, tiles.size(), {}});
  }
  return evaluator.result();
}

}  // namespace gdfmap
