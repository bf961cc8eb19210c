#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <gdfmap/core/instruction_set.hpp>
#include <gdfmap/fit/cube_problem.hpp>

namespace gdfmap {

template <typename Scalar>
struct FitArrays;
template <typename Scalar>
struct FitKernels;
template <typename Scalar>
struct PursuitDictionary;

/// As many cube problems as a vector register has lanes, solved side by side, one a lane, without
/// ever forming a Jacobian: on a regular grid every Gaussian and every derivative of one is a
/// product of three vectors, so the normal matrix is an elementwise product of three small Gram
/// matrices and the gradient a tensor contraction. A lane's numbers depend on its problem alone and
/// are the same for every instruction set.
///
/// `Scalar` is float, or double for the reference of one lane. All problems of a batch have the
/// same grid of samples and the same number of Gaussians. Not thread-safe; the float batches want
/// FlushToZero around them.
template <typename Scalar>
class TensorBatch {
 public:
  using Parameters = FitParameters<Scalar>;

  /// @param grid           one of kTrainingGrids
  /// @param max_gaussians  that resize() may ask for; so many until it does
  /// @param set            a supported one; without effect on the reference
  TensorBatch(const TrainingGrid& grid, int max_gaussians,
              InstructionSet set = best_instruction_set());
  ~TensorBatch();
  TensorBatch(TensorBatch&&) noexcept;

  [[nodiscard]] int num_lanes() const;
  [[nodiscard]] int num_gaussians() const;
  /// Sets the number of Gaussians; the candidates keep the first ones that they have, and nothing
  /// else keeps its meaning but the problems and the weighted residuals.
  void resize(int num_gaussians);

  /// What a lane is to solve.
  struct LaneProblem {
    int lane;
    CubeProblem problem;  ///< on the grid of this batch
  };
  /// Many at once take less time than one by one.
  void set_problems(std::span<const LaneProblem> problems);
  /// Whether these targets were the last that a lane was given.
  [[nodiscard]] bool holds(int lane, const CubeProblem& problem) const;
  /// Where evaluate() goes next. Fewer columns than Gaussians: the rest has no weight.
  void set_candidate(int lane, const Parameters& parameters);
  [[nodiscard]] Parameters candidate(int lane) const;

  /// Moves all lanes to their candidates.
  void evaluate();
  /// ½ Σ ω r² where a lane was evaluated last.
  [[nodiscard]] double cost(int lane) const;

  /// Takes candidate, normal matrix and gradient of the accepted lanes as where they stand; the
  /// other lanes keep theirs. Wants evaluate() before.
  void accept(const std::vector<bool>& lanes);
  /// Sets the candidates to the damped, clamped, projected steps from where the lanes stand:
  /// (JᵀJ + λ diag(JᵀJ) + ridge) δ = −Jᵀr.
  void step(std::span<const double> damping);
  /// By how much the quadratic model expects the cost to fall on that step.
  [[nodiscard]] double predicted_decrease(int lane) const;

  /// Moves the candidates' weights to the least-squares ones for their shapes; `ridge` times the
  /// mean diagonal is added to the Gram matrix; where it is singular nevertheless the weights stay.
  /// Wants evaluate() before and leaves what it found as it was.
  void solve_weights(double ridge);
  /// What the candidates miss at every sample, for pursue().
  void compute_residuals();
  /// Sets Gaussians [first, first + count) of the candidates to what the residuals ask for most:
  /// tensor products of a small dictionary, found by matching pursuit, with weight 0. Wants
  /// compute_residuals() before.
  void pursue(int first, int count);

  /// Absolute errors of a lane's candidate at the held-out samples of the grid, in edges, x
  /// slowest.
  void set_held_out(int lane, std::span<const float> targets, double scale);
  /// @param level  of the cubes, which decides how positions are rounded
  void compute_held_out_errors(int level);
  [[nodiscard]] double held_out_error(int lane, int sample) const;

  /// JᵀJ (both triangles) and Jᵀr where a lane stands, in the order of the parameters' storage.
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  [[nodiscard]] Matrix normal_matrix(int lane) const;
  [[nodiscard]] Vector gradient(int lane) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

extern template class TensorBatch<float>;
extern template class TensorBatch<double>;

}  // namespace gdfmap
