#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <gdfmap/core/run_context.hpp>

#include "evaluation_domain.hpp"
#include "evaluation_truth.hpp"

namespace gdfmap {

/// A place where the field is judged.
struct EvaluationSample {
  Vector3 p_world;        ///< where the field is asked, metres
  LatticePoint p;         ///< the same, rounded to the lattice
  int level = 0;          ///< of the finest cube that holds it, or kNoLevel
  double weight = 1.0;    ///< m³ that it stands for
  double distance = 0.0;  ///< the true one, metres
};

/// Receives samples piece by piece.
using SampleVisitor = std::function<void(std::span<const EvaluationSample>)>;

/// Limits of the parts, metres, that regions of the domain are divided into by distance.
inline constexpr std::array<double, 6> kBandLimits = {0.0, 0.1, 0.5, 2.0, 10.0, kMaxJudgedDistance};

/// Random samples as evaluate() describes them, near ones next to each other.
void visit_stratified_samples(const EvaluationDomain& domain, EvaluationTruth& truth,
                              const Lattice& lattice, std::uint64_t num_samples, std::uint64_t seed,
                              const RunContext& context, const SampleVisitor& visit);

/// The ancestor's samples: a regular grid of `step` metres in every cube of level 0, half a step
/// from its corner. A visit for each tile.
void visit_regular_samples(const JudgedLevel& level, EvaluationTruth& truth, const Lattice& lattice,
                           double step, const RunContext& context, const SampleVisitor& visit);

/// Number of regular samples of a cube.
[[nodiscard]] std::uint64_t regular_samples_per_cube(double step, double edge);

/// How many of `counts` to take of each, `total` in all: equal numbers as far as there are so many.
[[nodiscard]] std::vector<std::uint64_t> equal_shares(std::span<const std::uint64_t> counts,
                                                      std::uint64_t total);

}  // namespace gdfmap
