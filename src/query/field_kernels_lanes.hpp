#pragma once

// Sums of Gaussians, written once for any lane type (src/core/lanes.hpp): a point at a time, its
// cubes' Gaussians in the lanes. Points scattered over a map share few cubes, so that lanes of
// points would be empty. Included by one .cpp file per instruction set; everything has internal
// linkage and works on raw arrays.

#include "core/lanes.hpp"
#include "field_kernels.hpp"

namespace gdfmap {
namespace {

/// a·b + c for results that need not be the same everywhere: fused where the processor does that.
template <typename Lanes>
inline Lanes multiply_add(Lanes a, Lanes b, Lanes c) {
  return fma(a, b, c);
}
inline PortableLanes<float, 8> multiply_add(PortableLanes<float, 8> a, PortableLanes<float, 8> b,
                                            PortableLanes<float, 8> c) {
  return a * b + c;
}

/// exp(−x/2) for x ≥ 0, to 1e-7 and the rounding of x relative. Never below 2⁻¹⁰⁰, so that no
/// product becomes denormal.
template <typename Lanes>
inline Lanes exp_minus_half(Lanes x) {
  const Lanes power = max(x * Lanes(-0.721347520f), Lanes(-100.0f));  // −½ log₂ e
  const Lanes shifted = power + Lanes(12582912.0f);  // 1.5 · 2²³ + nearest integer
  const Lanes r = power - (shifted - Lanes(12582912.0f));
  // 2ʳ on [−½, ½], minimax to 7.5e-8.
  Lanes series = multiply_add(r, Lanes(0.00132764722f), Lanes(0.00967554133f));
  series = multiply_add(series, r, Lanes(0.0555071327f));
  series = multiply_add(series, r, Lanes(0.240221197f));
  series = multiply_add(series, r, Lanes(0.693146967f));
  series = multiply_add(series, r, Lanes(1.00000007f));
  return series * power_of_two(shifted);
}

template <typename Lanes>
struct FieldArithmetic {
  static constexpr std::uint32_t kW = Lanes::kWidth;
  static_assert(kW == 8, "rows are filled up to 8");

  /// A point's value and gradient, or a cube's, still spread over the lanes; the gradient with the
  /// opposite sign.
  struct Sums {
    Lanes value = Lanes(0.0f), x = Lanes(0.0f), y = Lanes(0.0f), z = Lanes(0.0f);
  };

  template <bool kGradient>
  static Sums sum_cube(const KernelTerm& term) {
    const Lanes px(term.p_local[0]), py(term.p_local[1]), pz(term.p_local[2]);
    const float* rows = term.rows;
    const std::size_t stride = term.stride;
    Sums cube;
    for (std::uint32_t k = 0; k < term.stride; k += kW, rows += kW) {
      const Lanes dx = px - Lanes::load(rows);
      const Lanes dy = py - Lanes::load(rows + stride);
      const Lanes dz = pz - Lanes::load(rows + 2 * stride);
      const Lanes sx = dx * Lanes::load(rows + 3 * stride);
      const Lanes sy = dy * Lanes::load(rows + 4 * stride);
      const Lanes sz = dz * Lanes::load(rows + 5 * stride);
      const Lanes exponent = multiply_add(dz, sz, multiply_add(dy, sy, dx * sx));
      const Lanes value = Lanes::load(rows + 6 * stride) * exp_minus_half(exponent);
      cube.value = cube.value + value;
      if constexpr (kGradient) {
        cube.x = multiply_add(value, sx, cube.x);
        cube.y = multiply_add(value, sy, cube.y);
        cube.z = multiply_add(value, sz, cube.z);
      }
    }
    return cube;
  }

  template <bool kGradient>
  static void add(const KernelTerm& term, Sums& sums) {
    const Sums cube = sum_cube<kGradient>(term);
    const Lanes weight(term.weight);
    sums.value = multiply_add(weight, cube.value, sums.value);
    if constexpr (kGradient) {
      const Lanes minus_value = Lanes(0.0f) - cube.value;
      sums.x = multiply_add(Lanes(term.weight_gradient[0]), minus_value,
                            multiply_add(weight, cube.x, sums.x));
      sums.y = multiply_add(Lanes(term.weight_gradient[1]), minus_value,
                            multiply_add(weight, cube.y, sums.y));
      sums.z = multiply_add(Lanes(term.weight_gradient[2]), minus_value,
                            multiply_add(weight, cube.z, sums.z));
    }
  }

  static void values(const KernelTerm* terms, const std::uint32_t* ends, std::size_t num_points,
                     float* values) {
    std::uint32_t term = 0;
    for (std::size_t i = 0; i < num_points; ++i) {
      Sums sums;
      for (; term < ends[i]; ++term) add<false>(terms[term], sums);
      float four[4];
      store_sums(sums.value, sums.value, sums.value, sums.value, four);
      values[i] = four[0];
    }
  }

  static void values_and_gradients(const KernelTerm* terms, const std::uint32_t* ends,
                                   std::size_t num_points, float (*value_gradients)[4]) {
    std::uint32_t term = 0;
    for (std::size_t i = 0; i < num_points; ++i) {
      Sums sums;
      for (; term < ends[i]; ++term) add<true>(terms[term], sums);
      const Lanes zero(0.0f);
      store_sums(sums.value, zero - sums.x, zero - sums.y, zero - sums.z, value_gradients[i]);
    }
  }

  static constexpr FieldKernels table() { return {values, values_and_gradients}; }
};

}  // namespace
}  // namespace gdfmap
