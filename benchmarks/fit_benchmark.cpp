// Steps of the optimiser, ours and Ceres', and whole fits.

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include <benchmark/benchmark.h>

#include <gdfmap/core/flush_to_zero.hpp>
#include <gdfmap/fit/cube_fit.hpp>
#include <gdfmap/fit/optimizers.hpp>
#include <gdfmap/fit/tensor_batch.hpp>

namespace gdfmap {
namespace {

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

template <typename Scalar>
OptimizerJob<Scalar> job(const std::array<float, kNumSamples>& values, Eigen::Index count) {
  FitParameters<double> parameters(kFitParameters, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto t = static_cast<double>(k);
    parameters.col(k) << 0.1, 0.5 + 0.5 * std::sin(t), 0.5 + 0.5 * std::cos(t), 0.5, std::log(0.5),
        std::log(0.4), std::log(0.6);
  }
  return {{values, 1.0}, parameters.cast<Scalar>()};
}

/// Eight iterations, so that the work before the first does not count much.
constexpr OptimizerOptions kEightSteps{8, 0.0};

/// Steps of single cubes: as many cubes as there are lanes take one together.
void tensor_steps(benchmark::State& state, InstructionSet set) {
  if (!is_supported(set)) {
    state.SkipWithError("not on this processor");
    return;
  }
  const FlushToZero flush_to_zero;
  const auto values = targets();
  TensorBatch<float> batch(static_cast<int>(state.range(0)), set);
  const std::vector<OptimizerJob<float>> start(static_cast<std::size_t>(batch.num_lanes()),
                                               job<float>(values, state.range(0)));
  for (auto _ : state) {
    auto jobs = start;
    minimize_tensor(batch, std::span(jobs), kEightSteps);
    benchmark::DoNotOptimize(jobs);
  }
  state.SetItemsProcessed(state.iterations() * kEightSteps.max_iterations * batch.num_lanes());
}
BENCHMARK_CAPTURE(tensor_steps, avx512, InstructionSet::kAvx512)->Arg(8)->Arg(16)->Arg(32);
BENCHMARK_CAPTURE(tensor_steps, avx2, InstructionSet::kAvx2)->Arg(8)->Arg(16)->Arg(32);

void ceres_steps(benchmark::State& state) {
  const FlushToZero flush_to_zero;
  const auto values = targets();
  const auto start = job<double>(values, state.range(0));
  for (auto _ : state) {
    auto result = start;
    minimize_ceres(result, kEightSteps);
    benchmark::DoNotOptimize(result);
  }
  state.SetItemsProcessed(state.iterations() * kEightSteps.max_iterations);
}
BENCHMARK(ceres_steps)->Arg(8)->Arg(16)->Arg(32)->Unit(benchmark::kMillisecond);

/// Whole fits, with the default ladder, of cubes of one kind.
void fit_whole_cubes(benchmark::State& state) {
  const auto values = targets();
  std::array<float, kNumHeldOut> held_out;
  for (int n = 0; n < kNumHeldOut; ++n) {
    constexpr int k = kHeldOutPerAxis;
    held_out[static_cast<std::size_t>(n)] =
        static_cast<float>(crease({held_out_position(n / (k * k), 0),
                                   held_out_position(n / k % k, 0), held_out_position(n % k, 0)}));
  }
  const std::vector<CubeSamples> cubes(64, CubeSamples{values, held_out, 0, 1.0, true});
  CubeFitter fitter{FitConfig{}};
  for (auto _ : state) {
    auto fits = fitter.fit(cubes);
    benchmark::DoNotOptimize(fits);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(cubes.size()));
}
BENCHMARK(fit_whole_cubes)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gdfmap
