// One step of the optimiser and one whole fit, ours and Ceres.

#include <algorithm>
#include <array>
#include <cmath>

#include <benchmark/benchmark.h>

#include <gdfmap/core/flush_to_zero.hpp>
#include <gdfmap/fit/cube_fit.hpp>
#include <gdfmap/fit/optimizers.hpp>

namespace gdfmap {
namespace {

using Problem = TensorProblem<double>;

/// Two walls that meet in a crease.
double crease(const Vector3& p) { return std::min(std::abs(p.x() - 0.3), std::abs(p.z() - 0.2)); }

std::array<float, kNumSamples> targets() {
  std::array<float, kNumSamples> result;
  for (int n = 0; n < kNumSamples; ++n) {
    constexpr int k = kSamplesPerAxis;
    result[static_cast<std::size_t>(n)] = static_cast<float>(
        crease({sample_position(n / (k * k)), sample_position(n / k % k), sample_position(n % k)}));
  }
  return result;
}

Problem::Parameters start(Eigen::Index count) {
  Problem::Parameters parameters(kFitParameters, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto t = static_cast<double>(k);
    parameters.col(k) << 0.1, 0.5 + 0.5 * std::sin(t), 0.5 + 0.5 * std::cos(t), 0.5, std::log(0.5),
        std::log(0.4), std::log(0.6);
  }
  return parameters;
}

/// Eight iterations, so that the work before the first does not count much.
constexpr OptimizerOptions kEightSteps{8, 0.0};

void tensor_steps(benchmark::State& state) {
  const FlushToZero flush_to_zero;
  const auto values = targets();
  Problem problem(values, 1.0);
  const auto parameters = start(state.range(0));
  for (auto _ : state) {
    auto result = minimize_tensor(problem, parameters, kEightSteps);
    benchmark::DoNotOptimize(result);
  }
  state.SetItemsProcessed(state.iterations() * kEightSteps.max_iterations);
}
BENCHMARK(tensor_steps)->Arg(8)->Arg(16)->Arg(32)->Unit(benchmark::kMillisecond);

void ceres_steps(benchmark::State& state) {
  const FlushToZero flush_to_zero;
  const auto values = targets();
  const Problem problem(values, 1.0);
  const auto parameters = start(state.range(0));
  for (auto _ : state) {
    auto result = minimize_ceres(problem, parameters, kEightSteps);
    benchmark::DoNotOptimize(result);
  }
  state.SetItemsProcessed(state.iterations() * kEightSteps.max_iterations);
}
BENCHMARK(ceres_steps)->Arg(8)->Arg(16)->Arg(32)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gdfmap
