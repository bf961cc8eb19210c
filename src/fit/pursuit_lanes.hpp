#pragma once

// Matching pursuit, one cube per lane. Like kernels_lanes.hpp, which it is a part of: internal
// linkage, raw arrays.

#include <gdfmap/fit/cube_problem.hpp>

#include "kernels.hpp"
#include "matrix_lanes.hpp"

namespace gdfmap {
namespace {

/// @tparam kN  samples an axis
template <typename Lanes, int kN>
struct PursuitArithmetic : LaneArrays<Lanes> {
  using typename LaneArrays<Lanes>::Scalar;
  using LaneArrays<Lanes>::kW, LaneArrays<Lanes>::at, LaneArrays<Lanes>::put;
  using Arrays = FitArrays<Scalar>;

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
#pragma GCC unroll 16
        for (int z = 0; z < kN; ++z) over_x[y][z] = Lanes(0);
        for (int x = 0; x < kN; ++x) {
          const Lanes value(Scalar(0) - d.value[ax][x]);
#pragma GCC unroll 16
          for (int z = 0; z < kN; ++z) {
            over_x[y][z] = fma(value, at(w.weighted_residual, (x * kN + y) * kN + z), over_x[y][z]);
          }
        }
      }
      for (int ay = 0; ay < d.num_atoms; ++ay) {
        Lanes over_y[kN];
#pragma GCC unroll 16
        for (int z = 0; z < kN; ++z) over_y[z] = Lanes(0);
        for (int y = 0; y < kN; ++y) {
          const Lanes value(d.value[ay][y]);
#pragma GCC unroll 16
          for (int z = 0; z < kN; ++z) over_y[z] = fma(value, over_x[y][z], over_y[z]);
        }
        for (int az = 0; az < d.num_atoms; ++az, ++place) {
          Lanes even(0), odd(0);
#pragma GCC unroll 8
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
};

}  // namespace
}  // namespace gdfmap
