#include <algorithm>
#include <cmath>
#include <utility>

#include <gdfmap/core/flush_to_zero.hpp>
#include <gdfmap/field/quantization.hpp>
#include <gdfmap/fit/cube_fit.hpp>
#include <gdfmap/fit/optimizers.hpp>
#include <gdfmap/fit/tensor_batch.hpp>

namespace gdfmap {
namespace {

constexpr int kAtomsPerRound = 4;
/// Ridges relative to the mean diagonal of the weights' Gram matrix: in pursuit, where atoms may be
/// much alike, and after rounding, where it only keeps the numbers finite.
constexpr double kPursuitRidge = 1e-5;
constexpr double kRoundingRidge = 1e-6;

/// A cube on its way up the ladder.
struct Climber {
  const CubeSamples* samples;
  FitParameters<float> parameters{kFitParameters, 0};
  CubeFit best;

  [[nodiscard]] CubeProblem problem() const {
    return {samples->targets, 1.0 / samples->edge, training_grid(samples->populated)};
  }
};
using Climbers = std::vector<Climber*>;

/// A mean and a standard deviation, in edges, as the codec keeps them.
struct StoredShape {
  double mean, sigma;
};
StoredShape rounded(double mean, double sigma, const CubeSamples& cube, CubeCodec codec) {
  if (codec == CubeCodec::kQuantized) {
    const GaussianGrid& grid = gaussian_grid(!cube.populated);
    return {grid.mean_of_code(grid.mean_code(mean)), grid.sigma_of_code(grid.sigma_code(sigma))};
  }
  const double edge = cube.edge;
  const double root_sigma = stored_root_sigma(sigma, edge);
  return {stored_mean(mean, edge) / edge, root_sigma * root_sigma / edge};
}

/// Rounds shapes to the stored precision, in the stored form and in the problem's.
Gaussians round_shapes(FitParameters<float>& parameters, const CubeSamples& cube, CubeCodec codec) {
  Gaussians gaussians(static_cast<std::size_t>(parameters.cols()));
  for (std::size_t k = 0; k < gaussians.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      float& mean = parameters(kFitMean + axis, column);
      float& log_sigma = parameters(kFitLogSigma + axis, column);
      const StoredShape shape =
          rounded(static_cast<double>(mean), std::exp(static_cast<double>(log_sigma)), cube, codec);
      gaussians.at(kMeanX + a, k) = stored_mean(shape.mean, cube.edge);
      gaussians.at(kRootSigmaX + a, k) = stored_root_sigma(shape.sigma, cube.edge);
      mean = static_cast<float>(shape.mean);
      log_sigma = static_cast<float>(std::log(shape.sigma));
    }
  }
  return gaussians;
}

CubeErrors summary(std::vector<double>& errors) {
  double sum = 0.0, sum_of_squares = 0.0;
  for (const double error : errors) {
    sum += error;
    sum_of_squares += error * error;
  }
  const auto count = static_cast<double>(errors.size());
  const auto rank95 =
      errors.begin() + static_cast<std::ptrdiff_t>((errors.size() * 95 + 99) / 100) - 1;
  std::nth_element(errors.begin(), rank95, errors.end());
  return {static_cast<float>(sum / count), static_cast<float>(std::sqrt(sum_of_squares / count)),
          static_cast<float>(*rank95), static_cast<float>(*std::max_element(rank95, errors.end()))};
}

/// Climbs the ladder with cubes of one class and level.
class Ladder {
 public:
  /// @param batch  large enough for the last step
  Ladder(const std::vector<int>& steps, const FitConfig& config, const CubeSamples& any,
         TensorBatch<float>& batch)
      : steps_(steps),
        config_(config),
        threshold_((any.populated ? config.mae_threshold : config.empty_mae_threshold) *
                   static_cast<double>(level_scale(any.level))),
        level_(any.level),
        batch_(batch) {}

  void climb(Climbers climbers) {
    const auto lanes = static_cast<std::size_t>(batch_.num_lanes());
    for (const int step : steps_) {
      for (std::size_t begin = 0; begin < climbers.size(); begin += lanes) {
        const auto group =
            std::span(climbers).subspan(begin, std::min(lanes, climbers.size() - begin));
        set_problems(group);
        grow(group, step);
        optimize(group);
        settle(group, step);
      }
      std::erase_if(climbers, [&](const Climber* c) { return !c->best.finite || is_good(*c); });
    }
  }

 private:
  [[nodiscard]] bool is_good(const Climber& c) const { return c.best.errors.mae <= threshold_; }

  /// A few climbers, one a lane of the batch.
  using Group = std::span<Climber* const>;

  void set_problems(Group group) {
    std::vector<TensorBatch<float>::LaneProblem> problems;
    for (const Climber* climber : group) {
      problems.push_back({static_cast<int>(problems.size()), climber->problem()});
    }
    batch_.set_problems(problems);
  }

  void set_candidates(Group group) {
    int lane = 0;
    for (const Climber* climber : group) batch_.set_candidate(lane++, climber->parameters);
  }

  /// Adds Gaussians by pursuit until there are `count`; the old ones keep their shapes.
  void grow(Group group, int count) {
    auto have = static_cast<int>(group.front()->parameters.cols());
    batch_.resize(have);
    set_candidates(group);
    while (have < count) {
      batch_.compute_residuals();
      const int added = std::min(count - have, kAtomsPerRound);
      batch_.resize(have + added);
      batch_.pursue(have, added);
      batch_.evaluate();
      batch_.solve_weights(kPursuitRidge);
      have += added;
    }
    for (std::size_t i = 0; i < group.size(); ++i) {
      group[i]->parameters = batch_.candidate(static_cast<int>(i));
    }
  }

  void optimize(Group group) {
    OptimizerOptions options;
    options.max_iterations = config_.max_iterations;
    if (config_.solver == Solver::kCeres) {
      optimize_each<double>(group, [&](std::span<OptimizerJob<double>> jobs) {
        for (OptimizerJob<double>& job : jobs) minimize_ceres(job, options);
      });
    } else {
      optimize_each<float>(group, [&](std::span<OptimizerJob<float>> jobs) {
        minimize_tensor(batch_, jobs, options);
      });
    }
  }

  template <typename Scalar, typename Minimize>
  static void optimize_each(Group group, const Minimize& minimize) {
    std::vector<OptimizerJob<Scalar>> jobs;
    for (const Climber* c : group) {
      jobs.push_back({c->problem(), c->parameters.template cast<Scalar>()});
    }
    minimize(std::span(jobs));
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      group[i]->parameters = jobs[i].parameters.template cast<float>();
      group[i]->best.num_iterations += jobs[i].num_iterations;
    }
  }

  /// Rounds to the stored precision, measures the errors and keeps what is better than before.
  void settle(Group group, int count) {
    batch_.resize(count);
    std::vector<Gaussians> stored;
    for (Climber* c : group) {
      stored.push_back(round_shapes(c->parameters, *c->samples, config_.codec));
    }
    set_candidates(group);
    batch_.evaluate();
    batch_.solve_weights(kRoundingRidge);
    for (std::size_t i = 0; i < group.size(); ++i) {
      const auto lane = static_cast<int>(i);
      round_weights(*group[i], lane, stored[i]);
      batch_.set_held_out(lane, group[i]->samples->held_out, 1.0 / group[i]->samples->edge);
    }
    batch_.compute_held_out_errors(level_);
    for (std::size_t i = 0; i < group.size(); ++i) {
      keep_if_better(*group[i], static_cast<int>(i), std::move(stored[i]));
    }
  }

  /// Takes the weights of a lane over, rounded.
  void round_weights(Climber& climber, int lane, Gaussians& gaussians) {
    const double edge = climber.samples->edge;
    FitParameters<float> solved = batch_.candidate(lane);
    for (std::size_t k = 0; k < gaussians.size(); ++k) {
      const float weight = solved(kFitWeight, static_cast<Eigen::Index>(k));
      gaussians.at(kWeight, k) = static_cast<float>(static_cast<double>(weight) * edge);
    }
    if (config_.codec != CubeCodec::kQuantized) return;
    gaussian_grid(!climber.samples->populated).quantize_weights(gaussians);
    for (std::size_t k = 0; k < gaussians.size(); ++k) {
      solved(kFitWeight, static_cast<Eigen::Index>(k)) =
          static_cast<float>(static_cast<double>(gaussians.at(kWeight, k)) / edge);
    }
    batch_.set_candidate(lane, solved);
  }

  void keep_if_better(Climber& climber, int lane, Gaussians gaussians) const {
    std::vector<double> held_out;
    for (int i = 0; i < static_cast<int>(climber.samples->held_out.size()); ++i) {
      held_out.push_back(climber.samples->edge * batch_.held_out_error(lane, i));
    }
    const CubeErrors errors = summary(held_out);
    CubeFit& best = climber.best;
    if (!std::isfinite(errors.rmse) || (best.finite && !(errors.mae < best.errors.mae))) return;
    best = {true, std::move(gaussians), errors, best.num_iterations};
  }

  const std::vector<int>& steps_;
  const FitConfig& config_;
  double threshold_;
  int level_;
  TensorBatch<float>& batch_;
};

}  // namespace

CubeFitter::CubeFitter(const FitConfig& config, InstructionSet set)
    : config_(config),
      populated_(kPopulatedGrid, config.populated_steps.back(), set),
      empty_(kEmptyGrid, config.empty_steps.back(), set) {}

std::vector<CubeFit> CubeFitter::fit(std::span<const CubeSamples> cubes) {
  const FlushToZero flush_to_zero;
  std::vector<Climber> climbers;
  for (const CubeSamples& samples : cubes) climbers.push_back({&samples, {}, {}});
  for (const bool populated : {true, false}) {
    Climbers of_class;
    for (Climber& c : climbers) {
      if (c.samples->populated == populated) of_class.push_back(&c);
    }
    if (of_class.empty()) continue;
    const std::vector<int>& steps = populated ? config_.populated_steps : config_.empty_steps;
    TensorBatch<float>& batch = populated ? populated_ : empty_;
    Ladder(steps, config_, *of_class.front()->samples, batch).climb(std::move(of_class));
  }
  std::vector<CubeFit> fits;
  for (Climber& c : climbers) fits.push_back(std::move(c.best));
  return fits;
}

}  // namespace gdfmap
