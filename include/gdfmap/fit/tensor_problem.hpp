#pragma once

#include <array>
#include <span>

#include <Eigen/Core>

#include <gdfmap/edt/sample_lattice.hpp>

namespace gdfmap {

/// Parameters of one Gaussian in the problem's vector, in units of the cube's edge. The last three
/// are logarithms of the standard deviations.
enum FitParameter : int {
  kFitWeight = 0,
  kFitMean = 1,
  kFitLogSigma = 4,
  kFitParameters = 7,
};

/// Bounds that every solver keeps: means in [−1, 2], standard deviations in [0.04, 4] edges.
inline constexpr double kMinMean = -1.0, kMaxMean = 2.0;
inline constexpr double kMinSigma = 0.04, kMaxSigma = 4.0;

/// Weights of the samples along an axis: 1 inside the cube; in the margin, where the cube's share
/// in the blended field falls, that share, but at least 0.15, since GDF1 readers give an outermost
/// cube full weight there. A sample counts with the product of its three weights.
[[nodiscard]] const std::array<double, kSamplesPerAxis>& axis_weights();

/// The weighted least-squares problem of one cube, without ever forming a Jacobian: on a regular
/// grid every Gaussian and every derivative of one is a product of three vectors, so the normal
/// matrix is an elementwise product of three small Gram matrices and the gradient a tensor
/// contraction.
///
/// Cost = ½ Σ_i ω_i (Σ_k w_k b_k(x_i) − t_i)². `Scalar` is float or double.
template <typename Scalar>
class TensorProblem {
 public:
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  /// Seven rows (FitParameter), one column per Gaussian.
  using Parameters = Eigen::Matrix<Scalar, kFitParameters, Eigen::Dynamic>;
  /// Rows run along x, columns along y and z (z fastest).
  using Grid =
      Eigen::Matrix<Scalar, kSamplesPerAxis, kSamplesPerAxis * kSamplesPerAxis, Eigen::RowMajor>;

  /// @param targets  distances at the samples, x slowest, z fastest
  /// @param scale    multiplies them: 1 / edge, for metres
  TensorProblem(std::span<const float, kNumSamples> targets, double scale);

  /// Moves to new parameters: computes basis vectors and residuals. @returns the cost there
  Scalar evaluate(const Parameters& parameters);

  /// At the parameters evaluated last: JᵀJ (both triangles) and Jᵀr, in the order of the
  /// parameters' storage (7 k + row).
  void normal_equations(Matrix& normal_matrix, Vector& gradient) const;

  /// At the parameters evaluated last: the least-squares weights with all shapes held, ridge ·
  /// trace/K added to the diagonal.
  [[nodiscard]] Vector solve_weights(Scalar ridge) const;

  /// Residuals (model − target), not weighted.
  [[nodiscard]] const Grid& residual() const { return residual_; }
  [[nodiscard]] const Grid& target() const { return target_; }

 private:
  /// Columns 3 k + (0 value, 1 derivative in the mean, 2 derivative in log sigma), one row a
  /// sample.
  using Basis = Eigen::Matrix<Scalar, kSamplesPerAxis, Eigen::Dynamic>;

  [[nodiscard]] Grid weighted(const Grid& grid) const;
  [[nodiscard]] Matrix gram(int axis) const;

  Grid target_;
  Grid residual_;
  Parameters parameters_;
  std::array<Basis, 3> basis_;
};

extern template class TensorProblem<float>;
extern template class TensorProblem<double>;

}  // namespace gdfmap
