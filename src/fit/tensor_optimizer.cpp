#include <algorithm>
#include <utility>

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

/// A lane of a batch, at its own step of its own job.
template <typename Scalar>
struct Lane {
  OptimizerJob<Scalar>* job = nullptr;  ///< none: idle
  bool started = false;                 ///< false until its start has been evaluated
  bool done = false;
  double damping = kInitialDamping;
};

template <typename Scalar>
class LaneOptimizer {
 public:
  LaneOptimizer(TensorBatch<Scalar>& batch, std::span<OptimizerJob<Scalar>> jobs,
                const OptimizerOptions& options)
      : batch_(batch),
        waiting_(jobs),
        options_(options),
        lanes_(static_cast<std::size_t>(batch_.num_lanes())),
        accepted_(lanes_.size()),
        damping_(lanes_.size()) {}

  void run() {
    refill();
    while (num_active_ > 0) {
      batch_.evaluate();
      judge();
      batch_.accept(accepted_);
      refill();
      step();
    }
  }

 private:
  /// Gives every lane that is idle or done the next job.
  void refill() {
    new_problems_.clear();
    for (std::size_t i = 0; i < lanes_.size(); ++i) {
      Lane<Scalar>& lane = lanes_[i];
      if (lane.job != nullptr && !lane.done) continue;
      if (lane.job != nullptr) --num_active_;
      lane = Lane<Scalar>{};
      if (waiting_.empty()) continue;
      lane.job = &waiting_.front();
      waiting_ = waiting_.subspan(1);
      ++num_active_;
      new_problems_.push_back({static_cast<int>(i), lane.job->problem});
      batch_.set_candidate(static_cast<int>(i), lane.job->parameters);
    }
    batch_.set_problems(new_problems_);
  }

  /// Decides which lanes stay where they were evaluated.
  void judge() {
    for (std::size_t i = 0; i < lanes_.size(); ++i) {
      accepted_[i] = lanes_[i].job != nullptr && judge(lanes_[i], static_cast<int>(i));
    }
  }

  bool judge(Lane<Scalar>& lane, int i) {
    OptimizerJob<Scalar>& job = *lane.job;
    const double cost = batch_.cost(i), gain = job.cost - cost;
    if (!std::exchange(lane.started, true)) {
      job.cost = cost;
      job.num_iterations = 0;
      lane.done = options_.max_iterations <= 0;
      return true;
    }
    const bool accepted = cost < job.cost;  // not where it is NaN
    if (accepted) {
      const double predicted = batch_.predicted_decrease(i);
      lane.damping *= damping_factor(predicted > 0.0 ? gain / predicted : 0.0);
      lane.damping = std::max(lane.damping, kLeastDamping);
      lane.done = gain <= options_.function_tolerance * job.cost;
      job.cost = cost;
      job.parameters = batch_.candidate(i);
    } else {
      lane.damping *= kRejectedFactor;
      lane.done = lane.damping >= kMostDamping;
    }
    if (++job.num_iterations >= options_.max_iterations) lane.done = true;
    return accepted;
  }

  void step() {
    for (std::size_t i = 0; i < lanes_.size(); ++i) damping_[i] = lanes_[i].damping;
    batch_.step(damping_);
    for (std::size_t i = 0; i < lanes_.size(); ++i) {
      const Lane<Scalar>& lane = lanes_[i];
      if (lane.job == nullptr || lane.started) continue;
      batch_.set_candidate(static_cast<int>(i), lane.job->parameters);
    }
  }

  TensorBatch<Scalar>& batch_;
  std::span<OptimizerJob<Scalar>> waiting_;
  OptimizerOptions options_;
  std::vector<Lane<Scalar>> lanes_;
  std::vector<typename TensorBatch<Scalar>::LaneProblem> new_problems_;
  std::vector<bool> accepted_;
  std::vector<double> damping_;
  int num_active_ = 0;
};

}  // namespace

template <typename Scalar>
void minimize_tensor(TensorBatch<Scalar>& batch, std::span<OptimizerJob<Scalar>> jobs,
                     const OptimizerOptions& options) {
  if (jobs.empty()) return;
  batch.resize(static_cast<int>(jobs.front().parameters.cols()));
  LaneOptimizer<Scalar>(batch, jobs, options).run();
}

template void minimize_tensor<float>(TensorBatch<float>&, std::span<OptimizerJob<float>>,
                                     const OptimizerOptions&);
template void minimize_tensor<double>(TensorBatch<double>&, std::span<OptimizerJob<double>>,
                                      const OptimizerOptions&);

}  // namespace gdfmap
