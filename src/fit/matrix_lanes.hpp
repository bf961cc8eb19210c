#pragma once

// Factors and solves one symmetric positive matrix per lane. Like kernels_lanes.hpp, which it is a
// part of: internal linkage, raw arrays.

#include "core/lanes.hpp"
#include "kernels.hpp"

namespace gdfmap {
namespace {

/// Arrays whose last index is the lane.
template <typename Lanes>
struct LaneArrays {
  using Scalar = typename Lanes::Scalar;
  static constexpr int kW = Lanes::kWidth;

  static Lanes at(const Scalar* array, int i) { return Lanes::load(array + i * kW); }
  static void put(Scalar* array, int i, Lanes v) { v.store(array + i * kW); }
};

template <typename Lanes>
struct MatrixArithmetic : LaneArrays<Lanes> {
  using typename LaneArrays<Lanes>::Scalar;
  using LaneArrays<Lanes>::kW, LaneArrays<Lanes>::at, LaneArrays<Lanes>::put;
  static constexpr int kT = kMatrixTile;

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
    const Scalar* const p = matrix + tile_index(i, j) * kW;
    for (int r = 0; r < kT; ++r) {
      for (int c = 0; c < kT; ++c) tile[r][c] = at(p, r * kT + c);
    }
  }
  static void store_tile(Scalar* matrix, int i, int j, const Tile& tile) {
    Scalar* const p = matrix + tile_index(i, j) * kW;
    for (int r = 0; r < kT; ++r) {
      for (int c = 0; c < kT; ++c) put(p, r * kT + c, tile[r][c]);
    }
  }

  /// tile −= (tile (i, m)) (tile (j, m))ᵀ.
  static void subtract_product(const Scalar* matrix, int i, int j, int m, Tile& tile) {
    const Scalar* const left = matrix + tile_index(i, m) * kW;
    const Scalar* const right = matrix + tile_index(j, m) * kW;
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
};

}  // namespace
}  // namespace gdfmap
