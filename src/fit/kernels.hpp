#pragma once

#include <algorithm>

#include <gdfmap/core/instruction_set.hpp>
#include <gdfmap/edt/sample_lattice.hpp>

namespace gdfmap {

/// A step moves a mean by at most 0.3 edges and a standard deviation by at most a factor of 2.
inline constexpr double kMostMeanStep = 0.3, kMostLogSigmaStep = 0.7;
/// Ridge on the weights, per sample and times the damping.
inline constexpr double kWeightRidge = 1e-6;
/// Added to the diagonal, as a share of its largest entry: a Gaussian of weight 0 has no
/// derivative.
inline constexpr double kDiagonalFloor = 1e-8;

/// The normal matrix is kept as the lower triangle of a matrix of square tiles, padded with rows of
/// the identity.
inline constexpr int kMatrixTile = 4;

// Of internal linkage, because the kernels call them too (see core/lanes.hpp).
namespace {

constexpr int num_matrix_tiles(int rows) { return (rows + kMatrixTile - 1) / kMatrixTile; }

/// Entries of the whole triangle of tiles.
constexpr int matrix_size(int rows) {
  const int n = num_matrix_tiles(rows);
  return n * (n + 1) / 2 * kMatrixTile * kMatrixTile;
}

/// Place of tile (i, j), i ≥ j, that of its first entry.
constexpr int tile_index(int i, int j) { return (i * (i + 1) / 2 + j) * kMatrixTile * kMatrixTile; }

/// Place of an entry of the lower triangle, row ≥ column.
constexpr int matrix_index(int row, int column) {
  return tile_index(row / kMatrixTile, column / kMatrixTile) + row % kMatrixTile * kMatrixTile +
         column % kMatrixTile;
}

}  // namespace

/// Atoms of pursuit along one axis, and what every tensor product of three of them needs.
template <typename Scalar>
struct PursuitDictionary {
  static constexpr int kMaxAtoms = 16;
  static constexpr int kMaxSamples = std::max(kPopulatedGrid.per_axis(), kEmptyGrid.per_axis());
  int num_atoms = 0;
  Scalar mean[kMaxAtoms], log_sigma[kMaxAtoms];
  Scalar value[kMaxAtoms][kMaxSamples];
  Scalar gram[kMaxAtoms][kMaxAtoms];                     ///< weighted inner products
  Scalar inverse_norm[kMaxAtoms][kMaxAtoms][kMaxAtoms];  ///< 1 / squared weighted norm
};

/// Working memory of the kernels for as many cubes as they have lanes, all with the same number of
/// Gaussians. The last index of every array is the lane. Owned by TensorBatch.
template <typename Scalar>
struct FitArrays {
  int num_gaussians = 0;
  int num_samples = 0;                        ///< n³ for n an axis
  const Scalar* sample_position = nullptr;    ///< [n], no lanes
  const Scalar* sample_weight = nullptr;      ///< [n], no lanes
  const Scalar* held_out_position = nullptr;  ///< [h] for h an axis, no lanes

  Scalar* target = nullptr;             ///< [n³]
  Scalar* held_out = nullptr;           ///< [h³]: targets, then absolute errors
  Scalar* parameters = nullptr;         ///< [7 K]: where the normal equations were taken
  Scalar* candidate = nullptr;          ///< [7 K]: where basis and contractions were taken
  Scalar* basis = nullptr;              ///< [axis][K][kind][n]
  Scalar* weighted_residual = nullptr;  ///< [n³]: ω (model − target)
  Scalar* contraction = nullptr;        ///< [axis][K][n]: of the residual, along the other axes
  Scalar* normal_matrix = nullptr;      ///< [matrix_size(7 K)]
  Scalar* gradient = nullptr;           ///< [7 K]: Jᵀr
  Scalar* factor = nullptr;             ///< [matrix_size(7 K)]
  Scalar* vector = nullptr;             ///< [7 K padded]: right side, then solution
  Scalar* correlation = nullptr;        ///< [atoms³]
  Scalar* cost = nullptr;               ///< [1]: ½ Σ ω r² at the candidate
  Scalar* damping = nullptr;            ///< [1]
  Scalar* predicted = nullptr;  ///< [1]: decrease of the cost that the quadratic model expects
  Scalar* accepted = nullptr;   ///< [1]: 1 where normal_equations() shall write, else 0
};

/// The arithmetic of the fit for one instruction set. Each function works on all lanes and treats
/// each as if it were alone.
template <typename Scalar>
struct FitKernels {
  int num_lanes;
  /// Basis, cost and contractions of the residual at the candidate.
  void (*evaluate)(const FitArrays<Scalar>&);
  /// Basis and weighted residual at the candidate.
  void (*compute_residuals)(const FitArrays<Scalar>&);
  /// Normal matrix and gradient at the candidate, written for the accepted lanes alone; wants
  /// evaluate() before.
  void (*normal_equations)(const FitArrays<Scalar>&);
  /// Solves the damped equations and sets the candidate to the clamped step from the parameters.
  void (*step)(const FitArrays<Scalar>&);
  /// Moves the candidate's weights to the least-squares ones for its shapes; wants evaluate()
  /// before, leaves basis and contractions as they were. `ridge` is relative to the mean diagonal.
  void (*solve_weights)(const FitArrays<Scalar>&, Scalar ridge);
  /// Sets the candidate's Gaussians [first, first + count) to the atoms that the residual asks for
  /// most, with weight 0; wants compute_residuals() before.
  void (*pursue)(const FitArrays<Scalar>&, const PursuitDictionary<Scalar>&, int first, int count);
  /// Replaces the held-out targets by the absolute errors of the candidate there.
  void (*held_out_errors)(const FitArrays<Scalar>&);
};

/// Float kernels of an instruction set, which must be supported, for one of kTrainingGrids.
[[nodiscard]] const FitKernels<float>& fit_kernels(InstructionSet set, const TrainingGrid& grid);
/// The same arithmetic in double, one cube at a time: the reference for tests.
[[nodiscard]] const FitKernels<double>& reference_fit_kernels(const TrainingGrid& grid);

namespace detail {
const FitKernels<float>& avx512_fit_kernels(const TrainingGrid& grid);
const FitKernels<float>& avx2_fit_kernels(const TrainingGrid& grid);
}  // namespace detail

}  // namespace gdfmap
