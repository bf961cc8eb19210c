#pragma once

// The arithmetic of the fit, written once for any lane type (src/core/lanes.hpp). Included by
// one .cpp file per instruction set; everything has internal linkage and works on raw arrays.

#include <limits>

#include <gdfmap/fit/cube_problem.hpp>

#include "core/lanes.hpp"
#include "kernels.hpp"

namespace gdfmap {
namespace {

constexpr int kN = kSamplesPerAxis;
constexpr int kKinds = 3;  // value, derivative in the mean, derivative in log sigma
constexpr int kT = kMatrixTile;

/// Which of an axis' three vectors a parameter asks for.
constexpr int basis_kind(int parameter, int axis) {
  if (parameter == kFitMean + axis) return 1;
  if (parameter == kFitLogSigma + axis) return 2;
  return 0;
}

/// Place of an entry of the lower triangle, row ≥ column, within the tiles.
constexpr int matrix_index(int row, int column) {
  const int i = row / kT, j = column / kT;
  return ((i * (i + 1) / 2 + j) * kT + row % kT) * kT + column % kT;
}

template <typename Lanes>
struct FitArithmetic {
  using Scalar = typename Lanes::Scalar;
  using Arrays = FitArrays<Scalar>;
  static constexpr int kW = Lanes::kWidth;

  static Lanes at(const Scalar* array, int i) { return Lanes::load(array + i * kW); }
  static void put(Scalar* array, int i, Lanes v) { v.store(array + i * kW); }

  /// The kN lane vectors of one kind of one Gaussian along one axis.
  static Scalar* basis(const Arrays& w, int axis, int k, int kind) {
    return w.basis + (((axis * w.num_gaussians + k) * kKinds + kind) * kN) * kW;
  }

  static void compute_basis(const Arrays& w) {
    for (int a = 0; a < 3; ++a) {
      for (int k = 0; k < w.num_gaussians; ++k) {
        const Lanes mean = at(w.candidate, kFitParameters * k + kFitMean + a);
        const Lanes inverse_sigma =
            exp(Lanes(0) - at(w.candidate, kFitParameters * k + kFitLogSigma + a));
        for (int i = 0; i < kN; ++i) {
          const Lanes u = (Lanes(w.sample_position[i]) - mean) * inverse_sigma;
          const Lanes value = exp(Lanes(Scalar(-0.5)) * u * u);
          const Lanes times_u = value * u;
          put(basis(w, a, k, 0), i, value);
          put(basis(w, a, k, 1), i, times_u * inverse_sigma);
          put(basis(w, a, k, 2), i, times_u * u);
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
#pragma GCC unroll 12
      for (int z = 0; z < kN; ++z) row[z] = fma(factor, at(along_z, z), row[z]);
    }
  }

  static void evaluate(const Arrays& w) {
    compute_basis(w);
    Lanes cost(0);
    for (int x = 0; x < kN; ++x) {
      Lanes cost_of_plane(0);
      for (int y = 0; y < kN; ++y) {
        Lanes row[kN];
        model_row(w, x, y, row);
        const Lanes weight_xy(w.sample_weight[x] * w.sample_weight[y]);
        Lanes cost_of_row(0);
        for (int z = 0; z < kN; ++z) {
          const int i = (x * kN + y) * kN + z;
          const Lanes residual = row[z] - at(w.target, i);
          const Lanes weighted = residual * weight_xy * Lanes(w.sample_weight[z]);
          put(w.weighted_residual, i, weighted);
          cost_of_row = fma(residual, weighted, cost_of_row);
        }
        cost_of_plane = cost_of_plane + cost_of_row;
      }
      cost = cost + cost_of_plane;
    }
    put(w.cost, 0, Lanes(Scalar(0.5)) * cost);
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

  /// Contractions of the weighted residual with the values of Gaussian k: over z into a plane of x
  /// and y, and over x and y into a row along z.
  static void contract(const Arrays& w, int k, Lanes (&plane)[kN][kN], Lanes (&row)[kN]) {
    const Scalar* const along_z = basis(w, 2, k, 0);
    for (int z = 0; z < kN; ++z) row[z] = Lanes(0);
    for (int x = 0; x < kN; ++x) {
      const Lanes value_x = at(basis(w, 0, k, 0), x);
      for (int y = 0; y < kN; ++y) {
        const Lanes factor = value_x * at(basis(w, 1, k, 0), y);
        const Scalar* const residual = w.weighted_residual + (x * kN + y) * kN * kW;
        // Two sums, for shorter chains of dependent additions.
        Lanes even(0), odd(0);
#pragma GCC unroll 6
        for (int z = 0; z < kN; z += 2) {
          const Lanes r0 = at(residual, z), r1 = at(residual, z + 1);
          even = fma(r0, at(along_z, z), even);
          odd = fma(r1, at(along_z, z + 1), odd);
          row[z] = fma(factor, r0, row[z]);
          row[z + 1] = fma(factor, r1, row[z + 1]);
        }
        plane[x][y] = even + odd;
      }
    }
  }

  static Lanes dot(const Lanes (&a)[kN], const Scalar* b) {
    Lanes sum(0);
    for (int i = 0; i < kN; ++i) sum = fma(a[i], at(b, i), sum);
    return sum;
  }

  static void gradient_of(const Arrays& w, int k, typename Lanes::Mask accepted) {
    Lanes plane[kN][kN], along_x[kN], along_y[kN], along_z[kN];
    contract(w, k, plane, along_z);
    for (int y = 0; y < kN; ++y) along_y[y] = Lanes(0);
    for (int x = 0; x < kN; ++x) {
      along_x[x] = dot(plane[x], basis(w, 1, k, 0));
      const Lanes value = at(basis(w, 0, k, 0), x);
      for (int y = 0; y < kN; ++y) along_y[y] = fma(value, plane[x][y], along_y[y]);
    }
    const Lanes weight = at(w.candidate, kFitParameters * k + kFitWeight);
    const auto set = [&](int parameter, Lanes value) {
      const int i = kFitParameters * k + parameter;
      put(w.gradient, i, select(accepted, value, at(w.gradient, i)));
    };
    set(kFitWeight, dot(along_z, basis(w, 2, k, 0)));
    for (int kind = 1; kind < kKinds; ++kind) {
      const int parameter = kind == 1 ? kFitMean : kFitLogSigma;
      set(parameter, weight * dot(along_x, basis(w, 0, k, kind)));
      set(parameter + 1, weight * dot(along_y, basis(w, 1, k, kind)));
      set(parameter + 2, weight * dot(along_z, basis(w, 2, k, kind)));
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

  /// Fills the tiles' rows from `rows` on with those of the identity.
  static void pad_with_identity(Scalar* matrix, int rows) {
    for (int row = rows; row < num_matrix_tiles(rows) * kT; ++row) {
      for (int column = 0; column <= row; ++column) {
        put(matrix, matrix_index(row, column), Lanes(Scalar(row == column ? 1 : 0)));
      }
    }
  }

  using Tile = Lanes[kT][kT];

  static void load_tile(const Scalar* matrix, int i, int j, Tile& tile) {
    const Scalar* const p = matrix + (i * (i + 1) / 2 + j) * kT * kT * kW;
    for (int r = 0; r < kT; ++r) {
      for (int c = 0; c < kT; ++c) tile[r][c] = at(p, r * kT + c);
    }
  }
  static void store_tile(Scalar* matrix, int i, int j, const Tile& tile) {
    Scalar* const p = matrix + (i * (i + 1) / 2 + j) * kT * kT * kW;
    for (int r = 0; r < kT; ++r) {
      for (int c = 0; c < kT; ++c) put(p, r * kT + c, tile[r][c]);
    }
  }

  /// tile −= (tile (i, m)) (tile (j, m))ᵀ.
  static void subtract_product(const Scalar* matrix, int i, int j, int m, Tile& tile) {
    const Scalar* const left = matrix + (i * (i + 1) / 2 + m) * kT * kT * kW;
    const Scalar* const right = matrix + (j * (j + 1) / 2 + m) * kT * kT * kW;
#pragma GCC unroll 4
    for (int k = 0; k < kT; ++k) {
      Lanes b[kT];
#pragma GCC unroll 4
      for (int c = 0; c < kT; ++c) b[c] = at(right, c * kT + k);
#pragma GCC unroll 4
      for (int r = 0; r < kT; ++r) {
        const Lanes a = at(left, r * kT + k);
#pragma GCC unroll 4
        for (int c = 0; c < kT; ++c) tile[r][c] = fnma(a, b[c], tile[r][c]);
      }
    }
  }

  /// Cholesky factor of a diagonal tile, with the inverse of its diagonal in place of it.
  static void factor_diagonal(Tile& tile) {
    for (int c = 0; c < kT; ++c) {
      for (int m = 0; m < c; ++m) tile[c][c] = fnma(tile[c][m], tile[c][m], tile[c][c]);
      tile[c][c] = Lanes(1) / sqrt(tile[c][c]);
      for (int r = c + 1; r < kT; ++r) {
        for (int m = 0; m < c; ++m) tile[r][c] = fnma(tile[r][m], tile[c][m], tile[r][c]);
        tile[r][c] = tile[r][c] * tile[c][c];
      }
    }
  }

  /// tile ← tile · (lower triangle of diagonal)⁻ᵀ.
  static void solve_triangle(const Tile& diagonal, Tile& tile) {
    for (int c = 0; c < kT; ++c) {
      for (int r = 0; r < kT; ++r) {
        for (int m = 0; m < c; ++m) tile[r][c] = fnma(tile[r][m], diagonal[c][m], tile[r][c]);
        tile[r][c] = tile[r][c] * diagonal[c][c];
      }
    }
  }

  /// Finishes tile (i, j) of the factor; those left of it in rows i and j are finished.
  static void factor_tile(Scalar* matrix, int i, int j) {
    Tile tile;
    load_tile(matrix, i, j, tile);
    for (int m = 0; m < j; ++m) subtract_product(matrix, i, j, m, tile);
    if (i == j) {
      factor_diagonal(tile);
    } else {
      Tile diagonal;
      load_tile(matrix, j, j, diagonal);
      solve_triangle(diagonal, tile);
    }
    store_tile(matrix, i, j, tile);
  }

  /// In place; the diagonal holds its inverse. A matrix that is not positive gives NaN. A panel of
  /// columns at a time, so that a row is fetched once for all of them.
  static void cholesky(Scalar* matrix, int num_tiles) {
    constexpr int kPanel = 8;
    for (int begin = 0; begin < num_tiles; begin += kPanel) {
      for (int i = begin; i < num_tiles; ++i) {
        for (int j = begin; j < begin + kPanel && j <= i; ++j) factor_tile(matrix, i, j);
      }
    }
  }

  /// vector ← (L Lᵀ)⁻¹ vector.
  static void solve_factored(const Scalar* factor, int rows, Scalar* vector) {
    for (int r = 0; r < rows; ++r) {
      Lanes sum = at(vector, r);
      for (int c = 0; c < r; ++c) {
        sum = fnma(at(factor, matrix_index(r, c)), at(vector, c), sum);
      }
      put(vector, r, sum * at(factor, matrix_index(r, r)));
    }
    for (int c = rows - 1; c >= 0; --c) {
      const Lanes solved = at(vector, c) * at(factor, matrix_index(c, c));
      put(vector, c, solved);
      for (int r = 0; r < c; ++r) {
        put(vector, r, fnma(at(factor, matrix_index(c, r)), solved, at(vector, r)));
      }
    }
  }

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
        damped = fma(damping, Lanes(Scalar(kWeightRidge * kNumSamples)), damped);
      }
      put(w.factor, matrix_index(r, r), select(free < Lanes(Scalar(0.5)), Lanes(1), damped));
    }
    pad_with_identity(w.factor, rows);
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
    cholesky(w.factor, num_matrix_tiles(rows));
    solve_factored(w.factor, rows, w.vector);
    take_step(w);
    put(w.predicted, 0, predicted_decrease(w));
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
      Lanes plane[kN][kN], along_z[kN];
      contract(w, l, plane, along_z);
      put(w.vector, l, Lanes(0) - dot(along_z, basis(w, 2, l, 0)));
    }
    const Lanes added = trace * Lanes(ridge / static_cast<Scalar>(rows));
    for (int k = 0; k < rows; ++k) {
      const int i = matrix_index(k, k);
      put(w.factor, i, at(w.factor, i) + added);
    }
    pad_with_identity(w.factor, rows);
    cholesky(w.factor, num_matrix_tiles(rows));
    solve_factored(w.factor, rows, w.vector);
    // Where shapes are so much alike that rounding made the matrix singular, the weights stay. They
    // become NaN with the cost alone, so that a problem that is none is noticed.
    const Lanes most(std::numeric_limits<Scalar>::max());
    const typename Lanes::Mask has_cost = at(w.cost, 0) <= most;
    for (int k = 0; k < rows; ++k) {
      const int i = kFitParameters * k + kFitWeight;
      const Lanes solved = at(w.candidate, i) + at(w.vector, k);
      const Lanes kept = select(abs(solved) <= most, solved, at(w.candidate, i));
      put(w.candidate, i, select(has_cost, kept, solved));
    }
  }

  /// The best atom of each lane: place in the dictionary's cube of products, and its weight.
  struct Choice {
    Lanes gain, place, weight;
  };

  static void consider(Lanes correlation, Scalar inverse_norm, int place, Choice& best) {
    const Lanes weight = correlation * Lanes(inverse_norm);
    const Lanes gain = weight * correlation;
    const typename Lanes::Mask better = best.gain < gain;
    best.gain = select(better, gain, best.gain);
    best.place = select(better, Lanes(static_cast<Scalar>(place)), best.place);
    best.weight = select(better, weight, best.weight);
  }

  static Choice no_choice() { return {Lanes(-1), Lanes(0), Lanes(0)}; }

  /// Inner products of every atom with what the model misses, and the best of them.
  static Choice correlate(const Arrays& w, const PursuitDictionary<Scalar>& d) {
    Choice best = no_choice();
    int place = 0;
    for (int ax = 0; ax < d.num_atoms; ++ax) {
      Lanes over_x[kN][kN];
      for (int y = 0; y < kN; ++y) {
#pragma GCC unroll 12
        for (int z = 0; z < kN; ++z) over_x[y][z] = Lanes(0);
        for (int x = 0; x < kN; ++x) {
          const Lanes value(Scalar(0) - d.value[ax][x]);
#pragma GCC unroll 12
          for (int z = 0; z < kN; ++z) {
            over_x[y][z] = fma(value, at(w.weighted_residual, (x * kN + y) * kN + z), over_x[y][z]);
          }
        }
      }
      for (int ay = 0; ay < d.num_atoms; ++ay) {
        Lanes over_y[kN];
#pragma GCC unroll 12
        for (int z = 0; z < kN; ++z) over_y[z] = Lanes(0);
        for (int y = 0; y < kN; ++y) {
          const Lanes value(d.value[ay][y]);
#pragma GCC unroll 12
          for (int z = 0; z < kN; ++z) over_y[z] = fma(value, over_x[y][z], over_y[z]);
        }
        for (int az = 0; az < d.num_atoms; ++az, ++place) {
          Lanes even(0), odd(0);
#pragma GCC unroll 6
          for (int z = 0; z < kN; z += 2) {
            even = fma(Lanes(d.value[az][z]), over_y[z], even);
            odd = fma(Lanes(d.value[az][z + 1]), over_y[z + 1], odd);
          }
          const Lanes correlation = even + odd;
          put(w.correlation, place, correlation);
          consider(correlation, d.inverse_norm[ax][ay][az], place, best);
        }
      }
    }
    return best;
  }

  /// Subtracts the projection on the chosen atoms, so that the next best ones are others, and
  /// returns those.
  static Choice deflate(const Arrays& w, const PursuitDictionary<Scalar>& d, const int (*atom)[kW],
                        Lanes weight) {
    Lanes gram[3][PursuitDictionary<Scalar>::kMaxAtoms];
    for (int a = 0; a < 3; ++a) {
      for (int i = 0; i < d.num_atoms; ++i) {
        alignas(64) Scalar column[kW];
        for (int lane = 0; lane < kW; ++lane) column[lane] = d.gram[i][atom[a][lane]];
        gram[a][i] = Lanes::load(column);
      }
    }
    Choice best = no_choice();
    int place = 0;
    for (int ax = 0; ax < d.num_atoms; ++ax) {
      const Lanes factor_x = weight * gram[0][ax];
      for (int ay = 0; ay < d.num_atoms; ++ay) {
        const Lanes factor = factor_x * gram[1][ay];
        for (int az = 0; az < d.num_atoms; ++az, ++place) {
          const Lanes correlation = fnma(factor, gram[2][az], at(w.correlation, place));
          put(w.correlation, place, correlation);
          consider(correlation, d.inverse_norm[ax][ay][az], place, best);
        }
      }
    }
    return best;
  }

  static void pursue(const Arrays& w, const PursuitDictionary<Scalar>& d, int first, int count) {
    Choice best = correlate(w, d);
    for (int k = first; k < first + count; ++k) {
      alignas(64) Scalar places[kW];
      best.place.store(places);
      int atom[3][kW];
      for (int lane = 0; lane < kW; ++lane) {
        const int place = static_cast<int>(places[lane]);
        atom[0][lane] = place / (d.num_atoms * d.num_atoms);
        atom[1][lane] = place / d.num_atoms % d.num_atoms;
        atom[2][lane] = place % d.num_atoms;
        Scalar* const p = w.candidate + kFitParameters * k * kW + lane;
        p[kFitWeight * kW] = Scalar(0);
        for (int a = 0; a < 3; ++a) {
          p[(kFitMean + a) * kW] = d.mean[atom[a][lane]];
          p[(kFitLogSigma + a) * kW] = d.log_sigma[atom[a][lane]];
        }
      }
      if (k + 1 < first + count) best = deflate(w, d, atom, best.weight);
    }
  }

  static void held_out_errors(const Arrays& w) {
    constexpr int n = kHeldOutPerAxis;
    Lanes errors[n * n * n];
    for (Lanes& e : errors) e = Lanes(0);
    for (int k = 0; k < w.num_gaussians; ++k) {
      Lanes value[3][n];
      for (int a = 0; a < 3; ++a) {
        const Lanes mean = at(w.candidate, kFitParameters * k + kFitMean + a);
        const Lanes inverse_sigma =
            exp(Lanes(0) - at(w.candidate, kFitParameters * k + kFitLogSigma + a));
        for (int i = 0; i < n; ++i) {
          const Lanes u = (Lanes(w.held_out_position[i]) - mean) * inverse_sigma;
          value[a][i] = exp(Lanes(Scalar(-0.5)) * u * u);
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
    return {kW, evaluate, normal_equations, step, solve_weights, pursue, held_out_errors};
  }
};

}  // namespace
}  // namespace gdfmap
