#pragma once

// The arithmetic of the fit, written once for any lane type (src/core/lanes.hpp). Included by
// one .cpp file per instruction set; everything has internal linkage and works on raw arrays.

#include <limits>

#include <gdfmap/fit/cube_problem.hpp>

#include "kernels.hpp"
#include "matrix_lanes.hpp"
#include "pursuit_lanes.hpp"
#include "step_lanes.hpp"

namespace gdfmap {
namespace {

constexpr int kKinds = 3;  // value, derivative in the mean, derivative in log sigma

/// Which of an axis' three vectors a parameter asks for.
constexpr int basis_kind(int parameter, int axis) {
  if (parameter == kFitMean + axis) return 1;
  if (parameter == kFitLogSigma + axis) return 2;
  return 0;
}

template <typename Lanes, TrainingGrid kGrid>
struct FitArithmetic : LaneArrays<Lanes> {
  static constexpr int kN = kGrid.per_axis();  ///< samples an axis
  static_assert(kN % 2 == 0, "taken two by two");
  using typename LaneArrays<Lanes>::Scalar;
  using LaneArrays<Lanes>::kW, LaneArrays<Lanes>::at, LaneArrays<Lanes>::put;
  using Arrays = FitArrays<Scalar>;
  using Matrix = MatrixArithmetic<Lanes>;

  /// The kN lane vectors of one kind of one Gaussian along one axis.
  static Scalar* basis(const Arrays& w, int axis, int k, int kind) {
    return w.basis + (((axis * w.num_gaussians + k) * kKinds + kind) * kN) * kW;
  }

  /// The candidate's Gaussian k along one axis.
  struct Shape {
    Lanes mean, inverse_sigma;

    Shape(const Arrays& w, int axis, int k)
        : mean(at(w.candidate, kFitParameters * k + kFitMean + axis)),
          inverse_sigma(exp(Lanes(0) - at(w.candidate, kFitParameters * k + kFitLogSigma + axis))) {
    }
    [[nodiscard]] Lanes offset(Scalar position) const {
      return (Lanes(position) - mean) * inverse_sigma;
    }
    static Lanes value(Lanes offset) { return exp(Lanes(Scalar(-0.5)) * offset * offset); }
  };

  static void compute_basis(const Arrays& w) {
    for (int a = 0; a < 3; ++a) {
      for (int k = 0; k < w.num_gaussians; ++k) {
        const Shape shape(w, a, k);
        const Scalar* const positions = w.sample_position;
        Scalar* const kinds = basis(w, a, k, 0);
        for (int i = 0; i < kN; ++i) {
          const Lanes u = shape.offset(positions[i]);
          const Lanes value = Shape::value(u);
          const Lanes times_u = value * u;
          put(kinds, i, value);
          put(kinds, kN + i, times_u * shape.inverse_sigma);
          put(kinds, 2 * kN + i, times_u * u);
        }
      }
    }
  }

  /// Σ_k w_k x_k y_k z_k along z, at one x and y.
  static void model_row(const Arrays& w, int x, int y, Lanes (&row)[kN]) {
    for (int z = 0; z < kN; ++z) row[z] = Lanes(0);
    for (int k = 0; k < w.num_gaussians; ++k) {
      const Lanes factor = at(w.candidate, kFitParameters * k + kFitWeight) *
                           at(basis(w, 0, k, 0), x) * at(basis(w, 1, k, 0), y);
      const Scalar* const along_z = basis(w, 2, k, 0);
#pragma GCC unroll 16
      for (int z = 0; z < kN; ++z) row[z] = fma(factor, at(along_z, z), row[z]);
    }
  }

  /// ω (model − target) along z, at one x and y; returns Σ ω (model − target)².
  static Lanes residual_row(const Arrays& w, int x, int y, Lanes (&weighted)[kN]) {
    Lanes row[kN];
    model_row(w, x, y, row);
    const Lanes weight_xy(w.sample_weight[x] * w.sample_weight[y]);
    Lanes cost(0);
    for (int z = 0; z < kN; ++z) {
      const Lanes residual = row[z] - at(w.target, (x * kN + y) * kN + z);
      weighted[z] = residual * weight_xy * Lanes(w.sample_weight[z]);
      cost = fma(residual, weighted[z], cost);
    }
    return cost;
  }

  /// The weighted residual contracted with the values of Gaussian k along the other two axes.
  static Scalar* contraction(const Arrays& w, int axis, int k) {
    return w.contraction + (axis * w.num_gaussians + k) * kN * kW;
  }

  using Plane = Lanes[kN][kN];

  /// Adds the plane of the residual at one x to the contractions of Gaussian k.
  static void contract_plane(const Arrays& w, int x, int k, const Plane& residual) {
    const Scalar* const along_y = basis(w, 1, k, 0);
    const Scalar* const along_z = basis(w, 2, k, 0);
    Scalar* const over_xz = contraction(w, 1, k);
    Scalar* const over_xy = contraction(w, 2, k);
    const Lanes value_x = at(basis(w, 0, k, 0), x);
    Lanes over_yz(0), row[kN];
    for (int z = 0; z < kN; ++z) row[z] = at(over_xy, z);
    for (int y = 0; y < kN; ++y) {
      const Lanes value_y = at(along_y, y), factor = value_x * value_y;
      // Two sums, for shorter chains of dependent additions.
      Lanes even(0), odd(0);
#pragma GCC unroll 8
      for (int z = 0; z < kN; z += 2) {
        const Lanes r0 = residual[y][z], r1 = residual[y][z + 1];
        even = fma(r0, at(along_z, z), even);
        odd = fma(r1, at(along_z, z + 1), odd);
        row[z] = fma(factor, r0, row[z]);
        row[z + 1] = fma(factor, r1, row[z + 1]);
      }
      const Lanes over_z = even + odd;
      over_yz = fma(over_z, value_y, over_yz);
      put(over_xz, y, fma(value_x, over_z, at(over_xz, y)));
    }
    for (int z = 0; z < kN; ++z) put(over_xy, z, row[z]);
    put(contraction(w, 0, k), x, over_yz);
  }

  /// Plane by plane: one stays in the nearest cache, all of them do not.
  static void evaluate(const Arrays& w) {
    compute_basis(w);
    for (int i = 0; i < 3 * w.num_gaussians * kN; ++i) put(w.contraction, i, Lanes(0));
    Lanes cost(0);
    for (int x = 0; x < kN; ++x) {
      Plane residual;
      Lanes cost_of_plane(0);
      for (int y = 0; y < kN; ++y) {
        cost_of_plane = cost_of_plane + residual_row(w, x, y, residual[y]);
      }
      cost = cost + cost_of_plane;
      for (int k = 0; k < w.num_gaussians; ++k) contract_plane(w, x, k, residual);
    }
    put(w.cost, 0, Lanes(Scalar(0.5)) * cost);
  }

  static void compute_residuals(const Arrays& w) {
    compute_basis(w);
    for (int i = 0; i < kN * kN; ++i) {
      Lanes row[kN];
      static_cast<void>(residual_row(w, i / kN, i % kN, row));
      for (int z = 0; z < kN; ++z) put(w.weighted_residual, i * kN + z, row[z]);
    }
  }

  /// Inner products over the samples of an axis of the `kinds` vectors of Gaussian k with the
  /// weighted ones of another.
  static void gram_block(const Scalar* of_k, const Lanes (&weighted)[kKinds][kN],
                         Lanes (&block)[kKinds][kKinds]) {
    for (int p = 0; p < kKinds; ++p) {
      for (int q = 0; q < kKinds; ++q) block[p][q] = Lanes(0);
    }
    for (int i = 0; i < kN; ++i) {
#pragma GCC unroll 3
      for (int p = 0; p < kKinds; ++p) {
        const Lanes v = at(of_k, p * kN + i);
#pragma GCC unroll 3
        for (int q = 0; q < kKinds; ++q) block[p][q] = fma(v, weighted[q][i], block[p][q]);
      }
    }
  }

  using WeightedBasis = Lanes[3][kKinds][kN];

  static void weigh_basis(const Arrays& w, int k, WeightedBasis& weighted) {
    for (int a = 0; a < 3; ++a) {
      for (int kind = 0; kind < kKinds; ++kind) {
        for (int i = 0; i < kN; ++i) {
          weighted[a][kind][i] = at(basis(w, a, k, kind), i) * Lanes(w.sample_weight[i]);
        }
      }
    }
  }

  /// The 7 × 7 entries that Gaussians k ≥ l share.
  static void normal_block(const Arrays& w, int k, int l, const WeightedBasis& weighted,
                           typename Lanes::Mask accepted) {
    Lanes gram[3][kKinds][kKinds];
    for (int a = 0; a < 3; ++a) gram_block(basis(w, a, k, 0), weighted[a], gram[a]);
    const Lanes weight_k = at(w.candidate, kFitParameters * k + kFitWeight);
    const Lanes weight_l = at(w.candidate, kFitParameters * l + kFitWeight);
#pragma GCC unroll 7
    for (int p = 0; p < kFitParameters; ++p) {
#pragma GCC unroll 7
      for (int q = 0; q < kFitParameters; ++q) {
        if (k == l && q > p) continue;
        Lanes entry = gram[0][basis_kind(p, 0)][basis_kind(q, 0)] *
                      gram[1][basis_kind(p, 1)][basis_kind(q, 1)] *
                      gram[2][basis_kind(p, 2)][basis_kind(q, 2)];
        if (p != kFitWeight) entry = entry * weight_k;
        if (q != kFitWeight) entry = entry * weight_l;
        const int i = matrix_index(kFitParameters * k + p, kFitParameters * l + q);
        put(w.normal_matrix, i, select(accepted, entry, at(w.normal_matrix, i)));
      }
    }
  }

  static Lanes dot(const Lanes (&a)[kN], const Scalar* b) {
    Lanes sum(0);
    for (int i = 0; i < kN; ++i) sum = fma(a[i], at(b, i), sum);
    return sum;
  }

  /// Derivative of the cost in one of a Gaussian's vectors, but for the Gaussian's weight.
  static Lanes derivative(const Arrays& w, int axis, int k, int kind) {
    const Scalar *const a = contraction(w, axis, k), *const b = basis(w, axis, k, kind);
    Lanes sum(0);
    for (int i = 0; i < kN; ++i) sum = fma(at(a, i), at(b, i), sum);
    return sum;
  }

  static void gradient_of(const Arrays& w, int k, typename Lanes::Mask accepted) {
    const auto set = [&](int parameter, Lanes value) {
      const int i = kFitParameters * k + parameter;
      put(w.gradient, i, select(accepted, value, at(w.gradient, i)));
    };
    const Lanes weight = at(w.candidate, kFitParameters * k + kFitWeight);
    set(kFitWeight, derivative(w, 2, k, 0));
    for (int axis = 0; axis < 3; ++axis) {
      set(kFitMean + axis, weight * derivative(w, axis, k, 1));
      set(kFitLogSigma + axis, weight * derivative(w, axis, k, 2));
    }
  }

  static void normal_equations(const Arrays& w) {
    const typename Lanes::Mask accepted = Lanes(Scalar(0.5)) < at(w.accepted, 0);
    for (int l = 0; l < w.num_gaussians; ++l) {
      WeightedBasis weighted;
      weigh_basis(w, l, weighted);
      for (int k = l; k < w.num_gaussians; ++k) normal_block(w, k, l, weighted, accepted);
      gradient_of(w, l, accepted);
    }
  }

  static void solve_weights(const Arrays& w, Scalar ridge) {
    const int rows = w.num_gaussians;
    Lanes trace(0);
    for (int l = 0; l < rows; ++l) {
      WeightedBasis weighted;
      weigh_basis(w, l, weighted);
      for (int k = l; k < rows; ++k) {
        Lanes entry(1);
        for (int a = 0; a < 3; ++a) entry = entry * dot(weighted[a][0], basis(w, a, k, 0));
        put(w.factor, matrix_index(k, l), entry);
        if (k == l) trace = trace + entry;
      }
      put(w.vector, l, Lanes(0) - derivative(w, 2, l, 0));
    }
    const Lanes added = trace * Lanes(ridge / static_cast<Scalar>(rows));
    for (int k = 0; k < rows; ++k) {
      const int i = matrix_index(k, k);
      put(w.factor, i, at(w.factor, i) + added);
    }
    Matrix::pad_with_identity(w.factor, rows);
    Matrix::cholesky(w.factor, num_matrix_tiles(rows));
    Matrix::solve_factored(w.factor, rows, w.vector);
    // Where shapes are so much alike that rounding made the matrix singular, the weights stay. They
    // become NaN with the cost alone, so that a problem that is none is noticed.
    constexpr Scalar kMost = std::numeric_limits<Scalar>::max();
    const Lanes most(kMost);
    const typename Lanes::Mask has_cost = at(w.cost, 0) <= most;
    for (int k = 0; k < rows; ++k) {
      const int i = kFitParameters * k + kFitWeight;
      const Lanes solved = at(w.candidate, i) + at(w.vector, k);
      const Lanes kept = select(abs(solved) <= most, solved, at(w.candidate, i));
      put(w.candidate, i, select(has_cost, kept, solved));
    }
  }

  static void held_out_errors(const Arrays& w) {
    constexpr int n = kGrid.held_out;
    Lanes errors[n * n * n];
    for (Lanes& e : errors) e = Lanes(0);
    for (int k = 0; k < w.num_gaussians; ++k) {
      Lanes value[3][n];
      for (int a = 0; a < 3; ++a) {
        const Shape shape(w, a, k);
        for (int i = 0; i < n; ++i) {
          value[a][i] = Shape::value(shape.offset(w.held_out_position[i]));
        }
      }
      const Lanes weight = at(w.candidate, kFitParameters * k + kFitWeight);
      for (int i = 0; i < n * n * n; ++i) {
        errors[i] =
            fma(weight * value[0][i / (n * n)] * value[1][i / n % n], value[2][i % n], errors[i]);
      }
    }
    for (int i = 0; i < n * n * n; ++i) put(w.held_out, i, abs(errors[i] - at(w.held_out, i)));
  }

  static constexpr FitKernels<Scalar> table() {
    return {kW,
            evaluate,
            compute_residuals,
            normal_equations,
            StepArithmetic<Lanes>::step,
            solve_weights,
            PursuitArithmetic<Lanes, kN>::pursue,
            held_out_errors};
  }
};

/// The kernels of a lane type for one of kTrainingGrids.
template <typename Lanes>
const FitKernels<typename Lanes::Scalar>& kernels_for(const TrainingGrid& grid) {
  static constexpr FitKernels<typename Lanes::Scalar> kernels[] = {
      FitArithmetic<Lanes, kPopulatedGrid>::table(), FitArithmetic<Lanes, kEmptyGrid>::table()};
  return kernels[grid == kPopulatedGrid ? 0 : 1];
}

}  // namespace
}  // namespace gdfmap
