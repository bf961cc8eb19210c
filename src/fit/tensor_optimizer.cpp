#include <algorithm>
#include <vector>

#include <gdfmap/core/error.hpp>
#include <gdfmap/fit/optimizers.hpp>
#include <gdfmap/fit/tensor_batch.hpp>

namespace gdfmap {
namespace {

constexpr double kInitialDamping = 1e-2;
constexpr double kLeastDamping = 1e-6;
constexpr double kMostDamping = 1e6;
constexpr double kRejectedFactor = 6.0;

/// Damping factor after an accepted step, by how well the quadratic model foretold it.
double damping_factor(double gain_ratio) {
  if (gain_ratio > 0.75) return 0.2;
  if (gain_ratio > 0.25) return 0.5;
  return 1.5;
}

/// The jobs of a batch on their way, one a lane.
template <typename Scalar>
class LaneOptimizer {
 public:
  LaneOptimizer(TensorBatch<Scalar>& batch, std::span<OptimizerJob<Scalar>> jobs,
                const OptimizerOptions& options)
      : batch_(batch),
        jobs_(jobs),
        options_(options),
        active_(jobs.size(), true),
        accepted_(static_cast<std::size_t>(batch.num_lanes())),
        damping_(accepted_.size(), kInitialDamping) {}

  void run() {
    start();
    while (std::ranges::find(active_, true) != active_.end()) {
      batch_.accept(accepted_);
      batch_.step(damping_);
      batch_.evaluate();
      for (std::size_t i = 0; i < jobs_.size(); ++i) accepted_[i] = active_[i] && judge(i);
    }
  }

 private:
  void start() {
    for (std::size_t i = 0; i < jobs_.size(); ++i) {
      batch_.set_candidate(static_cast<int>(i), jobs_[i].parameters);
    }
    batch_.evaluate();
    for (std::size_t i = 0; i < jobs_.size(); ++i) {
      jobs_[i].cost = batch_.cost(static_cast<int>(i));
      jobs_[i].num_iterations = 0;
      active_[i] = options_.max_iterations > 0;
      accepted_[i] = true;
    }
  }

  /// Whether a lane stays where it was evaluated; takes the result over if so.
  bool judge(std::size_t i) {
    OptimizerJob<Scalar>& job = jobs_[i];
    const auto lane = static_cast<int>(i);
    const double cost = batch_.cost(lane), gain = job.cost - cost;
    const bool accepted = cost < job.cost;  // not where it is NaN
    double& damping = damping_[i];
    if (accepted) {
      const double predicted = batch_.predicted_decrease(lane);
      damping *= damping_factor(predicted > 0.0 ? gain / predicted : 0.0);
      damping = std::max(damping, kLeastDamping);
      active_[i] = gain > options_.function_tolerance * job.cost;
      job.cost = cost;
      job.parameters = batch_.candidate(lane);
    } else {
      damping *= kRejectedFactor;
      active_[i] = damping < kMostDamping;
    }
    if (++job.num_iterations >= options_.max_iterations) active_[i] = false;
    return accepted;
  }

  TensorBatch<Scalar>& batch_;
  std::span<OptimizerJob<Scalar>> jobs_;
  OptimizerOptions options_;
  std::vector<bool> active_;    // of every job
  std::vector<bool> accepted_;  // of every lane, those without a job too
  std::vector<double> damping_;
};

}  // namespace

template <typename Scalar>
void minimize_tensor(TensorBatch<Scalar>& batch, std::span<OptimizerJob<Scalar>> jobs,
                     const OptimizerOptions& options) {
  if (jobs.empty()) return;
  if (jobs.size() > static_cast<std::size_t>(batch.num_lanes())) {
    throw Error(ErrorCode::kInternal, "more jobs than their batch has lanes");
  }
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (!batch.holds(static_cast<int>(i), jobs[i].problem)) {
      throw Error(ErrorCode::kInternal, "a job whose problem its lane does not hold");
    }
  }
  batch.resize(static_cast<int>(jobs.front().parameters.cols()));
  LaneOptimizer<Scalar>(batch, jobs, options).run();
}

template void minimize_tensor<float>(TensorBatch<float>&, std::span<OptimizerJob<float>>,
                                     const OptimizerOptions&);
template void minimize_tensor<double>(TensorBatch<double>&, std::span<OptimizerJob<double>>,
                                      const OptimizerOptions&);

}  // namespace gdfmap
