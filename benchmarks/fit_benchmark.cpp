// Steps of the optimiser, ours and Ceres', and whole fits.

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include <benchmark/benchmark.h>

#include <gdfmap/core/flush_to_zero.hpp>
#include <gdfmap/fit/cube_fit.hpp>
#include <gdfmap/fit/optimizers.hpp>
#include <gdfmap/fit/tensor_batch.hpp>

#include "support/cube_targets.hpp"

namespace gdfmap {
namespace {

/// Two walls that meet in a crease.
double crease(const Vector3& p) { return std::min(std::abs(p.x() - 0.3), std::abs(p.z() - 0.2)); }

template <typename Scalar>
OptimizerJob<Scalar> job(const CubeProblem& problem, Eigen::Index count) {
  FitParameters<double> parameters(kFitParameters, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto t = static_cast<double>(k);
    parameters.col(k) << 0.1, 0.5 + 0.5 * std::sin(t), 0.5 + 0.5 * std::cos(t), 0.5, std::log(0.5),
        std::log(0.4), std::log(0.6);
  }
  return {problem, parameters.cast<Scalar>()};
}

/// Operations on the numbers of one cube when its lane is evaluated, accepted and stepped once: an
/// addition, a multiplication or both fused count one. As src/fit/kernels_lanes.hpp has them; what
/// is left out grows with K n or slower.
double operations_of_a_step(const TrainingGrid& grid, double K) {
  constexpr double kExp = 18.0, kKinds = 3.0, kParameters = 7.0;
  const double n = grid.per_axis(), rows = kParameters * K;
  const double basis = 3.0 * K * n * (kExp + 7.0);
  const double model = K * n * n * (n + 2.0) + 4.0 * n * n * n;
  const double pair = 3.0 * kKinds * kKinds * n + 2.0 * 49.0 + 2.0 * 42.0;
  const double normal_matrix = K * (K + 1.0) / 2.0 * pair + K * 3.0 * kKinds * n;
  const double gradient = K * (2.0 * n * n * n + 4.0 * n * n + kParameters * n);
  const double factor_and_solve = rows * rows * rows / 6.0 + rows * rows;
  const double damping_and_prediction = 1.5 * rows * rows;
  return basis + model + normal_matrix + gradient + factor_and_solve + damping_and_prediction;
}

/// As fast as the core goes: independent fused multiply-adds in registers, and nothing else.
#if defined(__x86_64__)
__attribute__((target("avx512f"))) void multiply_adds(benchmark::State& state) {
  if (!is_supported(InstructionSet::kAvx512)) {
    state.SkipWithError("not on this processor");
    return;
  }
  constexpr int kChains = 16, kRounds = 4096, kLanes = 16;
  __m512 sums[kChains] = {}, factor = {}, addend = {};
  for (auto _ : state) {
    benchmark::DoNotOptimize(factor);
    benchmark::DoNotOptimize(addend);
    for (int round = 0; round < kRounds; ++round) {
#pragma GCC unroll 16
      for (__m512& sum : sums) sum = _mm512_fmadd_ps(sum, factor, addend);
    }
    benchmark::DoNotOptimize(sums);
  }
  state.counters["operations"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * kChains * kRounds * kLanes,
                         benchmark::Counter::kIsRate);
}
BENCHMARK(multiply_adds);
#endif

/// Eight iterations, so that the work before the first does not count much.
constexpr OptimizerOptions kEightSteps{8, 0.0};

/// Steps of single cubes: as many cubes as there are lanes take one together.
void tensor_steps(benchmark::State& state, InstructionSet set) {
  if (!is_supported(set)) {
    state.SkipWithError("not on this processor");
    return;
  }
  const FlushToZero flush_to_zero;
  const test::CubeTargets targets(crease);
  TensorBatch<float> batch(kPopulatedGrid, static_cast<int>(state.range(0)), set);
  const std::vector<OptimizerJob<float>> start(static_cast<std::size_t>(batch.num_lanes()),
                                               job<float>(targets.problem(), state.range(0)));
  for (int lane = 0; lane < batch.num_lanes(); ++lane) {
    batch.set_problems({{{lane, targets.problem()}}});
  }
  for (auto _ : state) {
    auto jobs = start;
    minimize_tensor(batch, std::span(jobs), kEightSteps);
    benchmark::DoNotOptimize(jobs);
  }
  state.SetItemsProcessed(state.iterations() * kEightSteps.max_iterations * batch.num_lanes());
  const double steps = kEightSteps.max_iterations * batch.num_lanes();
  state.counters["operations"] = benchmark::Counter(
      static_cast<double>(state.iterations()) * steps *
          operations_of_a_step(kPopulatedGrid, static_cast<double>(state.range(0))),
      benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(tensor_steps, avx512, InstructionSet::kAvx512)->Arg(8)->Arg(16)->Arg(32);
BENCHMARK_CAPTURE(tensor_steps, avx2, InstructionSet::kAvx2)->Arg(8)->Arg(16)->Arg(32);

void ceres_steps(benchmark::State& state) {
  const FlushToZero flush_to_zero;
  const test::CubeTargets targets(crease);
  const auto start = job<double>(targets.problem(), state.range(0));
  for (auto _ : state) {
    auto result = start;
    minimize_ceres(result, kEightSteps);
    benchmark::DoNotOptimize(result);
  }
  state.SetItemsProcessed(state.iterations() * kEightSteps.max_iterations);
}
BENCHMARK(ceres_steps)->Arg(8)->Arg(16)->Arg(32)->Unit(benchmark::kMillisecond);

/// Whole fits, with the default ladder, of cubes of one class: 1 populated, 0 empty.
void fit_whole_cubes(benchmark::State& state) {
  const test::CubeTargets targets(crease, state.range(0) != 0);
  const std::vector<CubeSamples> cubes(64, targets.samples());
  CubeFitter fitter{FitConfig{}};
  for (auto _ : state) {
    auto fits = fitter.fit(cubes);
    benchmark::DoNotOptimize(fits);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(cubes.size()));
}
BENCHMARK(fit_whole_cubes)->ArgName("populated")->Arg(1)->Arg(0)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gdfmap
