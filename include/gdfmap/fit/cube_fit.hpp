#pragma once

#include <span>
#include <vector>

#include <gdfmap/core/instruction_set.hpp>
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

/// Fits cubes: pursuit finds where Gaussians are missing, the solver moves all of them, the weights
/// are solved for once more after rounding; again with more Gaussians for those whose held-out
/// error does not meet the threshold yet. A cube's fit depends on its samples and the configuration
/// alone, not on the others nor on the instruction set; many at a time make good use of a vector
/// register. All cubes are of one level. Thread-safe.
/// @param set  a supported one
[[nodiscard]] std::vector<CubeFit> fit_cubes(std::span<const CubeSamples> cubes,
                                             const FitConfig& config,
                                             InstructionSet set = best_instruction_set());

}  // namespace gdfmap
