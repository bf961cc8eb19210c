#pragma once

#include <span>

#include <gdfmap/edt/sample_lattice.hpp>
#include <gdfmap/field/cube_errors.hpp>
#include <gdfmap/field/gaussians.hpp>
#include <gdfmap/fit/fit_config.hpp>

namespace gdfmap {

/// Exact distances (metres) at the samples of one cube; x runs slowest, z fastest. Not owned.
struct CubeSamples {
  std::span<const float, kNumSamples> targets;
  std::span<const float, kNumHeldOut> held_out;
  int level = 0;
  double edge = 1.0;       ///< metres
  bool populated = false;  ///< holds points
};

/// The Gaussians of the best rung of the ladder and their errors at the held-out samples.
struct CubeFit {
  bool finite = false;  ///< false: no rung gave finite numbers, and the rest says nothing
  Gaussians gaussians;
  CubeErrors errors;
  int num_iterations = 0;  ///< over all rungs
};

/// Fits one cube: pursuit finds where Gaussians are missing, the solver moves all of them, the
/// weights are solved for once more after rounding; again with more Gaussians until the held-out
/// error meets the threshold. A pure function of its arguments; thread-safe.
[[nodiscard]] CubeFit fit_cube(const CubeSamples& samples, const FitConfig& config);

}  // namespace gdfmap
