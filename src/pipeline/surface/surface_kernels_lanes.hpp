#pragma once

// Written once for any lane type (src/core/lanes.hpp). Included by one .cpp file per instruction
// set; everything has internal linkage and works on raw arrays.

#include "aligned_floats.hpp"
#include "core/lanes.hpp"
#include "surface_kernels.hpp"

namespace gdfmap::surface {
namespace {

template <typename Lanes>
struct SurfaceArithmetic {
  static constexpr std::size_t kW = Lanes::kWidth;
  /// Vectors of a row that are summed side by side, to keep the multipliers busy.
  static constexpr std::size_t kVectors = 4;
  static_assert(kLaneFloats % kW == 0);

  static Lanes bell(Lanes offset, Lanes inverse) {
    return exp(offset * offset * inverse * Lanes(-0.5f));
  }

  static void factors_of_gaussian(const float* position, const float* share, std::size_t count,
                                  float mean, float inverse, float* out) {
    const Lanes centre(mean), narrowness(inverse);
    for (std::size_t i = 0; i < count; i += kW) {
      const Lanes offset = Lanes::load(position + i) - centre;
      (bell(offset, narrowness) * Lanes::load(share + i)).store(out + i);
    }
  }

  static void factors_of_sample(float position, float share, const float* mean,
                                const float* inverse, const float* factor, std::size_t count,
                                float* out) {
    const Lanes p(position), part(share);
    for (std::size_t k = 0; k < count; k += kW) {
      const Lanes offset = p - Lanes::load(mean + k);
      const Lanes value = bell(offset, Lanes::load(inverse + k)) * part;
      (factor == nullptr ? value : value * Lanes::load(factor + k)).store(out + k);
    }
  }

  template <std::size_t kCount>
  static void add_vectors(const BlockTerm& term, std::size_t x, float* row) {
    Lanes sum[kCount];
    for (std::size_t v = 0; v < kCount; ++v) sum[v] = Lanes::load(row + x + v * kW);
    const float* factors = term.x + x;
    for (std::size_t k = 0; k < term.num_gaussians; ++k, factors += term.x_stride) {
      const Lanes product(term.products[k]);
      for (std::size_t v = 0; v < kCount; ++v) {
        sum[v] = fma(product, Lanes::load(factors + v * kW), sum[v]);
      }
    }
    for (std::size_t v = 0; v < kCount; ++v) sum[v].store(row + x + v * kW);
  }

  static void add_row(const BlockTerm& term, std::size_t y, std::size_t z) {
    const float* const y_factors = term.y + y * term.stride;
    const float* const z_factors = term.z + z * term.stride;
    for (std::size_t k = 0; k < term.stride; k += kW) {
      (Lanes::load(y_factors + k) * Lanes::load(z_factors + k)).store(term.products + k);
    }
    float* const row = term.values + z * term.plane + y * term.row;
    std::size_t x = term.x_begin;
    for (; x + kVectors * kW <= term.x_end; x += kVectors * kW) {
      add_vectors<kVectors>(term, x, row);
    }
    for (; x + 2 * kW <= term.x_end; x += 2 * kW) add_vectors<2>(term, x, row);
    for (; x < term.x_end; x += kW) add_vectors<1>(term, x, row);
  }

  static void add_block(const BlockTerm& term) {
    for (std::size_t z = term.z_begin; z < term.z_end; ++z) {
      for (std::size_t y = term.y_begin; y < term.y_end; ++y) add_row(term, y, z);
    }
  }

  static void values_and_gradients(const GaussianRows& cube, const PointTerm& points) {
    for (std::size_t i = 0; i < points.num_points; i += kW) {
      Lanes value(0.0f), slope[3] = {Lanes(0.0f), Lanes(0.0f), Lanes(0.0f)};
      for (std::size_t k = 0; k < cube.count; ++k) {
        Lanes scaled[3], exponent(0.0f);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const Lanes offset = Lanes::load(points.p_local[axis] + i) - Lanes(cube.mean[axis][k]);
          scaled[axis] = offset * Lanes(cube.inverse[axis][k]);
          exponent = fma(offset, scaled[axis], exponent);
        }
        const Lanes gaussian = Lanes(cube.weight[k]) * exp(exponent * Lanes(-0.5f));
        value = value + gaussian;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          slope[axis] = fnma(gaussian, scaled[axis], slope[axis]);
        }
      }
      value.store(points.value + i);
      for (std::size_t axis = 0; axis < 3; ++axis) slope[axis].store(points.gradient[axis] + i);
    }
  }

  static constexpr SurfaceKernels table() {
    return {factors_of_gaussian, factors_of_sample, add_block, values_and_gradients};
  }
};

}  // namespace
}  // namespace gdfmap::surface
