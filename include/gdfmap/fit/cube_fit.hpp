#pragma once

#include <span>
#include <vector>

#include <gdfmap/core/instruction_set.hpp>
#include <gdfmap/field/cube_errors.hpp>
#include <gdfmap/field/gaussians.hpp>
#include <gdfmap/fit/fit_config.hpp>
#include <gdfmap/fit/tensor_batch.hpp>

namespace gdfmap {

/// Exact distances (metres) at the samples of one cube; x runs slowest, z fastest. Not owned.
struct CubeSamples {
  std::span<const float> targets, held_out;  ///< on the grid of its class
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
/// alone, not on the others, on what was fitted before nor on the instruction set; many at a time
/// make good use of a vector register. Keeps its working memory, some megabytes, between calls. Not
/// thread-safe.
class CubeFitter {
 public:
  /// @param set  a supported one
  explicit CubeFitter(const FitConfig& config, InstructionSet set = best_instruction_set());

  /// @param cubes  of one level
  [[nodiscard]] std::vector<CubeFit> fit(std::span<const CubeSamples> cubes);

 private:
  FitConfig config_;
  TensorBatch<float> populated_, empty_;
};

}  // namespace gdfmap
