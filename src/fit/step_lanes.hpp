#pragma once

// Steps of Levenberg and Marquardt, one cube per lane. Like kernels_lanes.hpp, which it is a part
// of: internal linkage, raw arrays.

#include <gdfmap/fit/cube_problem.hpp>

#include "kernels.hpp"
#include "matrix_lanes.hpp"

namespace gdfmap {
namespace {

template <typename Lanes>
struct StepArithmetic : LaneArrays<Lanes> {
  using typename LaneArrays<Lanes>::Scalar;
  using LaneArrays<Lanes>::at, LaneArrays<Lanes>::put;
  using Arrays = FitArrays<Scalar>;
  using Matrix = MatrixArithmetic<Lanes>;

  static Lanes least_value(int row) {
    return Lanes(Scalar(row < kFitLogSigma ? kMinMean : kMinLogSigma));
  }
  static Lanes most_value(int row) {
    return Lanes(Scalar(row < kFitLogSigma ? kMaxMean : kMaxLogSigma));
  }

  /// 1 where a parameter may move, 0 where it stands at a bound and would leave it.
  static Lanes freedom(const Arrays& w, int i) {
    const int row = i % kFitParameters;
    if (row == kFitWeight) return Lanes(1);
    const Lanes value = at(w.parameters, i), gradient = at(w.gradient, i);
    const typename Lanes::Mask held = ((value <= least_value(row)) & (Lanes(0) < gradient)) |
                                      ((most_value(row) <= value) & (gradient < Lanes(0)));
    return select(held, Lanes(0), Lanes(1));
  }

  /// factor ← JᵀJ + λ diag(JᵀJ) + ridge, vector ← −Jᵀr; rows and columns of held parameters become
  /// those of the identity, so that the others do not count on a movement that cannot happen.
  static void damped_equations(const Arrays& w) {
    const int rows = kFitParameters * w.num_gaussians;
    const Lanes damping = at(w.damping, 0);
    const Lanes ridge(static_cast<Scalar>(kWeightRidge * w.num_samples));
    Lanes largest(0);
    for (int r = 0; r < rows; ++r) largest = max(largest, at(w.normal_matrix, matrix_index(r, r)));
    const Lanes floor = Lanes(Scalar(kDiagonalFloor)) * largest;
    for (int r = 0; r < rows; ++r) {
      const Lanes free = freedom(w, r);
      put(w.vector, r, (Lanes(0) - free) * at(w.gradient, r));
      // Freedoms of the columns so far are kept where their solution will be.
      put(w.candidate, r, free);
      for (int c = 0; c < r; ++c) {
        const int i = matrix_index(r, c);
        put(w.factor, i, at(w.normal_matrix, i) * free * at(w.candidate, c));
      }
      const Lanes diagonal = at(w.normal_matrix, matrix_index(r, r));
      Lanes damped = diagonal + fma(damping, max(diagonal, floor), floor);
      if (r % kFitParameters == kFitWeight) {
        damped = fma(damping, ridge, damped);
      }
      put(w.factor, matrix_index(r, r), select(free < Lanes(Scalar(0.5)), Lanes(1), damped));
    }
    Matrix::pad_with_identity(w.factor, rows);
  }

  static Lanes clamped(Lanes v, Lanes low, Lanes high) { return min(max(v, low), high); }

  /// Candidate ← parameters + clamped step, projected on the bounds; vector ← the step taken.
  static void take_step(const Arrays& w) {
    for (int i = 0; i < kFitParameters * w.num_gaussians; ++i) {
      const int row = i % kFitParameters;
      const Lanes from = at(w.parameters, i);
      Lanes step = at(w.vector, i);
      Lanes to = from + step;
      if (row != kFitWeight) {
        const Lanes most(Scalar(row < kFitLogSigma ? kMostMeanStep : kMostLogSigmaStep));
        to =
            clamped(from + clamped(step, Lanes(0) - most, most), least_value(row), most_value(row));
      }
      put(w.candidate, i, to);
      put(w.vector, i, to - from);
    }
  }

  /// −gᵀδ − ½ δᵀHδ for the step taken.
  static Lanes predicted_decrease(const Arrays& w) {
    Lanes sum(0);
    for (int r = 0; r < kFitParameters * w.num_gaussians; ++r) {
      const Lanes step = at(w.vector, r);
      Lanes product = Lanes(Scalar(0.5)) * at(w.normal_matrix, matrix_index(r, r)) * step;
      for (int c = 0; c < r; ++c) {
        product = fma(at(w.normal_matrix, matrix_index(r, c)), at(w.vector, c), product);
      }
      sum = fnma(step, at(w.gradient, r) + product, sum);
    }
    return sum;
  }

  static void step(const Arrays& w) {
    const int rows = kFitParameters * w.num_gaussians;
    damped_equations(w);
    Matrix::cholesky(w.factor, num_matrix_tiles(rows));
    Matrix::solve_factored(w.factor, rows, w.vector);
    take_step(w);
    put(w.predicted, 0, predicted_decrease(w));
  }
};

}  // namespace
}  // namespace gdfmap
