#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>
#include <string>
#include <type_traits>
#include <utility>

#include <gdfmap/core/error.hpp>
#include <gdfmap/field/blending.hpp>
#include <gdfmap/fit/tensor_batch.hpp>

#include "kernels.hpp"
#include "pursuit_dictionary.hpp"

namespace gdfmap {
namespace {

constexpr double kLeastMarginWeight = 0.15;
constexpr std::size_t kAlignment = 64;

template <typename Scalar>
const FitKernels<Scalar>& kernels_of(InstructionSet set, const TrainingGrid& grid) {
  if constexpr (std::is_same_v<Scalar, float>) {
    return fit_kernels(set, grid);
  } else {
    return reference_fit_kernels(grid);
  }
}

struct Free {
  void operator()(void* p) const { std::free(p); }
};

}  // namespace

std::vector<double> axis_weights(const TrainingGrid& grid) {
  std::vector<double> weights;
  for (int i = 0; i < grid.per_axis(); ++i) {
    const double x = grid.position(i);
    const double outside = std::max({-x, x - 1.0, 0.0});
    const double share = smoothstep((kMarginRatio - outside) / (2.0 * kMarginRatio));
    weights.push_back(outside > 0.0 ? std::max(share, kLeastMarginWeight) : 1.0);
  }
  return weights;
}

template <typename Scalar>
struct TensorBatch<Scalar>::Impl {
  TrainingGrid grid;
  const FitKernels<Scalar>& kernels;
  int max_gaussians;
  FitArrays<Scalar> arrays;
  std::unique_ptr<void, Free> memory;
  std::vector<Scalar> sample_positions, sample_weights, held_out_positions;
  std::vector<const float*> held;  ///< targets of every lane, to be compared, not read

  Impl(const TrainingGrid& samples, int count, InstructionSet set)
      : grid(samples), kernels(kernels_of<Scalar>(set, samples)), max_gaussians(count) {
    held.resize(lanes());
    arrays.num_gaussians = max_gaussians;
    arrays.num_samples = static_cast<int>(grid.size());
    allocate();
    for (const double weight : axis_weights(grid)) {
      const auto i = static_cast<int>(sample_weights.size());
      sample_positions.push_back(static_cast<Scalar>(grid.position(i)));
      sample_weights.push_back(static_cast<Scalar>(weight));
    }
    arrays.sample_position = sample_positions.data();
    arrays.sample_weight = sample_weights.data();
    held_out_positions.resize(static_cast<std::size_t>(grid.held_out));
    arrays.held_out_position = held_out_positions.data();
  }

  [[nodiscard]] std::size_t lanes() const { return static_cast<std::size_t>(kernels.num_lanes); }

  /// One zeroed piece of memory for all arrays: an idle lane holds harmless numbers. What few
  /// Gaussians do not need is never touched.
  void allocate() {
    const int rows = kFitParameters * max_gaussians;
    constexpr int kAtoms = PursuitDictionary<Scalar>::kMaxAtoms;
    const std::pair<Scalar**, int> sizes[] = {
        {&arrays.target, arrays.num_samples},
        {&arrays.held_out, static_cast<int>(grid.num_held_out())},
        {&arrays.parameters, rows},
        {&arrays.candidate, rows},
        {&arrays.basis, 9 * max_gaussians * grid.per_axis()},
        {&arrays.weighted_residual, arrays.num_samples},
        {&arrays.contraction, 3 * max_gaussians * grid.per_axis()},
        {&arrays.normal_matrix, matrix_size(rows)},
        {&arrays.gradient, rows},
        {&arrays.factor, matrix_size(rows)},
        {&arrays.vector, rows},
        {&arrays.correlation, kAtoms * kAtoms * kAtoms},
        {&arrays.cost, 1},
        {&arrays.damping, 1},
        {&arrays.predicted, 1},
        {&arrays.accepted, 1}};
    const auto rounded = [&](int size) {
      const std::size_t bytes = static_cast<std::size_t>(size) * lanes() * sizeof(Scalar);
      return (bytes + kAlignment - 1) / kAlignment * kAlignment / sizeof(Scalar);
    };
    std::size_t total = 0;
    for (const auto& [array, size] : sizes) total += rounded(size);
    std::size_t num_bytes = total * sizeof(Scalar) + kAlignment;
    memory.reset(std::calloc(num_bytes, 1));
    if (!memory) throw std::bad_alloc();
    void* begin = memory.get();
    auto* next =
        static_cast<Scalar*>(std::align(kAlignment, total * sizeof(Scalar), begin, num_bytes));
    for (const auto& [array, size] : sizes) {
      *array = next;
      next += rounded(size);
    }
  }

  [[nodiscard]] Scalar& at(Scalar* array, std::size_t i, int lane) const {
    return array[i * lanes() + static_cast<std::size_t>(lane)];
  }
};

template <typename Scalar>
TensorBatch<Scalar>::TensorBatch(const TrainingGrid& grid, int max_gaussians, InstructionSet set)
    : impl_(std::make_unique<Impl>(grid, max_gaussians, set)) {}
template <typename Scalar>
TensorBatch<Scalar>::~TensorBatch() = default;
template <typename Scalar>
TensorBatch<Scalar>::TensorBatch(TensorBatch&&) noexcept = default;

template <typename Scalar>
int TensorBatch<Scalar>::num_lanes() const {
  return impl_->kernels.num_lanes;
}

template <typename Scalar>
int TensorBatch<Scalar>::num_gaussians() const {
  return impl_->arrays.num_gaussians;
}

template <typename Scalar>
void TensorBatch<Scalar>::resize(int num_gaussians) {
  if (num_gaussians > impl_->max_gaussians) {
    throw Error(ErrorCode::kInternal, "a batch for " + std::to_string(impl_->max_gaussians) +
                                          " Gaussians was asked for " +
                                          std::to_string(num_gaussians));
  }
  impl_->arrays.num_gaussians = num_gaussians;
}

/// The targets of a sample lie side by side: a few samples at a time for all lanes, so that what is
/// written to stays in the nearest cache.
template <typename Scalar>
void TensorBatch<Scalar>::set_problems(std::span<const LaneProblem> problems) {
  for (const auto& [lane, problem] : problems) {
    if (problem.grid != impl_->grid || problem.targets.size() != impl_->grid.size()) {
      throw Error(ErrorCode::kInternal, "a problem on another grid of samples than its batch");
    }
  }
  for (const auto& [lane, problem] : problems) {
    impl_->held[static_cast<std::size_t>(lane)] = problem.targets.data();
  }
  constexpr std::size_t kSamples = 64;
  const std::size_t size = impl_->grid.size();
  for (std::size_t begin = 0; begin < size; begin += kSamples) {
    const std::size_t end = std::min(begin + kSamples, size);
    for (const auto& [lane, problem] : problems) {
      for (std::size_t i = begin; i < end; ++i) {
        impl_->at(impl_->arrays.target, i, lane) =
            static_cast<Scalar>(problem.scale * static_cast<double>(problem.targets[i]));
      }
    }
  }
}

template <typename Scalar>
bool TensorBatch<Scalar>::holds(int lane, const CubeProblem& problem) const {
  return impl_->held[static_cast<std::size_t>(lane)] == problem.targets.data();
}

template <typename Scalar>
void TensorBatch<Scalar>::set_candidate(int lane, const Parameters& parameters) {
  const auto size = static_cast<std::size_t>(kFitParameters * num_gaussians());
  const auto given = static_cast<std::size_t>(parameters.size());
  for (std::size_t i = 0; i < size; ++i) {
    impl_->at(impl_->arrays.candidate, i, lane) = i < given ? parameters.data()[i] : Scalar(0);
  }
}

template <typename Scalar>
typename TensorBatch<Scalar>::Parameters TensorBatch<Scalar>::candidate(int lane) const {
  Parameters result(kFitParameters, num_gaussians());
  for (Eigen::Index i = 0; i < result.size(); ++i) {
    result.data()[i] = impl_->at(impl_->arrays.candidate, static_cast<std::size_t>(i), lane);
  }
  return result;
}

template <typename Scalar>
void TensorBatch<Scalar>::evaluate() {
  impl_->kernels.evaluate(impl_->arrays);
}

template <typename Scalar>
void TensorBatch<Scalar>::compute_residuals() {
  impl_->kernels.compute_residuals(impl_->arrays);
}

template <typename Scalar>
double TensorBatch<Scalar>::cost(int lane) const {
  return static_cast<double>(impl_->at(impl_->arrays.cost, 0, lane));
}

template <typename Scalar>
void TensorBatch<Scalar>::accept(const std::vector<bool>& lanes) {
  const FitArrays<Scalar>& arrays = impl_->arrays;
  const auto size = static_cast<std::size_t>(kFitParameters * num_gaussians());
  for (int lane = 0; lane < num_lanes(); ++lane) {
    const bool accepted = lanes[static_cast<std::size_t>(lane)];
    impl_->at(arrays.accepted, 0, lane) = accepted ? Scalar(1) : Scalar(0);
    if (!accepted) continue;
    for (std::size_t i = 0; i < size; ++i) {
      impl_->at(arrays.parameters, i, lane) = impl_->at(arrays.candidate, i, lane);
    }
  }
  impl_->kernels.normal_equations(arrays);
}

template <typename Scalar>
void TensorBatch<Scalar>::step(std::span<const double> damping) {
  for (int lane = 0; lane < num_lanes(); ++lane) {
    impl_->at(impl_->arrays.damping, 0, lane) =
        static_cast<Scalar>(damping[static_cast<std::size_t>(lane)]);
  }
  impl_->kernels.step(impl_->arrays);
}

template <typename Scalar>
double TensorBatch<Scalar>::predicted_decrease(int lane) const {
  return static_cast<double>(impl_->at(impl_->arrays.predicted, 0, lane));
}

template <typename Scalar>
void TensorBatch<Scalar>::solve_weights(double ridge) {
  impl_->kernels.solve_weights(impl_->arrays, static_cast<Scalar>(ridge));
}

template <typename Scalar>
void TensorBatch<Scalar>::pursue(int first, int count) {
  impl_->kernels.pursue(impl_->arrays, pursuit_dictionary<Scalar>(impl_->grid), first, count);
}

template <typename Scalar>
void TensorBatch<Scalar>::set_held_out(int lane, std::span<const float> targets, double scale) {
  if (targets.size() != impl_->grid.num_held_out()) {
    throw Error(ErrorCode::kInternal, "held-out samples on another grid than their batch");
  }
  for (std::size_t i = 0; i < targets.size(); ++i) {
    impl_->at(impl_->arrays.held_out, i, lane) =
        static_cast<Scalar>(scale * static_cast<double>(targets[i]));
  }
}

template <typename Scalar>
void TensorBatch<Scalar>::compute_held_out_errors(int level) {
  for (int i = 0; i < impl_->grid.held_out; ++i) {
    impl_->held_out_positions[static_cast<std::size_t>(i)] =
        static_cast<Scalar>(impl_->grid.held_out_position(i, level));
  }
  impl_->kernels.held_out_errors(impl_->arrays);
}

template <typename Scalar>
double TensorBatch<Scalar>::held_out_error(int lane, int sample) const {
  return static_cast<double>(
      impl_->at(impl_->arrays.held_out, static_cast<std::size_t>(sample), lane));
}

template <typename Scalar>
typename TensorBatch<Scalar>::Matrix TensorBatch<Scalar>::normal_matrix(int lane) const {
  const Eigen::Index rows = kFitParameters * num_gaussians();
  Matrix result(rows, rows);
  for (Eigen::Index r = 0; r < rows; ++r) {
    for (Eigen::Index c = 0; c < rows; ++c) {
      const int place =
          matrix_index(static_cast<int>(std::max(r, c)), static_cast<int>(std::min(r, c)));
      result(r, c) = impl_->at(impl_->arrays.normal_matrix, static_cast<std::size_t>(place), lane);
    }
  }
  return result;
}

template <typename Scalar>
typename TensorBatch<Scalar>::Vector TensorBatch<Scalar>::gradient(int lane) const {
  Vector result(kFitParameters * num_gaussians());
  for (Eigen::Index i = 0; i < result.size(); ++i) {
    result[i] = impl_->at(impl_->arrays.gradient, static_cast<std::size_t>(i), lane);
  }
  return result;
}

template class TensorBatch<float>;
template class TensorBatch<double>;

}  // namespace gdfmap
