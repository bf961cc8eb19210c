#pragma once

// Short vectors, one independent computation per lane, for .cpp files that are compiled once per
// instruction set. Every operation is exact IEEE arithmetic of its lane alone, with explicit fused
// multiply-add, so that a lane's result is the same for every width and instruction set. smallest()
// and largest() cross lanes, but no order changes them; store_sums() adds lanes up in an order of
// its own and is nothing for what must be the same everywhere.
//
// Everything here has internal linkage: a function that leaked out of a file compiled for AVX-512
// could be the copy that the linker keeps for all.

#include <cmath>
#include <cstdint>
#include <cstring>

#if defined(__AVX2__) || defined(__AVX512F__)
#include <immintrin.h>
#endif

namespace gdfmap {
namespace {

/// a·b + c rounded once, without hardware for it: the product of two floats is exact in double, and
/// the sum is rounded to odd there, which makes the second rounding harmless (Boldo and Melquiond,
/// "Emulation of a FMA and correctly rounded sums", IEEE Trans. Computers 57, 2008).
inline float fused_multiply_add(float a, float b, float c) {
  const double product = static_cast<double>(a) * static_cast<double>(b);
  const double addend = static_cast<double>(c);
  double sum = product + addend;
  const double rest = sum - product;
  const double error = (product - (sum - rest)) + (addend - rest);
  if (error > 0.0 || error < 0.0) {
    std::int64_t bits;
    std::memcpy(&bits, &sum, sizeof(bits));
    if ((bits & 1) == 0) bits += (error > 0.0) == (sum > 0.0) ? 1 : -1;
    std::memcpy(&sum, &bits, sizeof(bits));
  }
  return static_cast<float>(sum);
}
/// The reference in double makes no promise about bits.
inline double fused_multiply_add(double a, double b, double c) { return a * b + c; }

/// `Width` lanes in plain C++.
template <typename Number, int Width>
struct PortableLanes {
  using Scalar = Number;
  static constexpr int kWidth = Width;
  struct Mask {
    bool v[Width];
  };
  Scalar v[Width];

  /// f(i) for every lane.
  template <typename F>
  static PortableLanes from(const F& f) {
    PortableLanes r;
    for (int i = 0; i < Width; ++i) r.v[i] = f(i);
    return r;
  }
  template <typename F>
  static Mask mask_from(const F& f) {
    Mask r;
    for (int i = 0; i < Width; ++i) r.v[i] = f(i);
    return r;
  }

  PortableLanes() = default;
  explicit PortableLanes(Scalar s) {
    for (int i = 0; i < Width; ++i) v[i] = s;
  }
  static PortableLanes load(const Scalar* p) {
    return from([p](int i) { return p[i]; });
  }
  void store(Scalar* p) const {
    for (int i = 0; i < Width; ++i) p[i] = v[i];
  }

  friend PortableLanes operator+(PortableLanes a, PortableLanes b) {
    return from([&](int i) { return a.v[i] + b.v[i]; });
  }
  friend PortableLanes operator-(PortableLanes a, PortableLanes b) {
    return from([&](int i) { return a.v[i] - b.v[i]; });
  }
  friend PortableLanes operator*(PortableLanes a, PortableLanes b) {
    return from([&](int i) { return a.v[i] * b.v[i]; });
  }
  friend PortableLanes operator/(PortableLanes a, PortableLanes b) {
    return from([&](int i) { return a.v[i] / b.v[i]; });
  }
  friend PortableLanes fma(PortableLanes a, PortableLanes b, PortableLanes c) {
    return from([&](int i) { return fused_multiply_add(a.v[i], b.v[i], c.v[i]); });
  }
  friend PortableLanes fnma(PortableLanes a, PortableLanes b, PortableLanes c) {
    return from([&](int i) { return fused_multiply_add(-a.v[i], b.v[i], c.v[i]); });
  }
  friend PortableLanes min(PortableLanes a, PortableLanes b) {
    return from([&](int i) { return a.v[i] < b.v[i] ? a.v[i] : b.v[i]; });
  }
  friend PortableLanes max(PortableLanes a, PortableLanes b) {
    return from([&](int i) { return a.v[i] > b.v[i] ? a.v[i] : b.v[i]; });
  }
  friend PortableLanes sqrt(PortableLanes a) {
    return from([&](int i) { return std::sqrt(a.v[i]); });
  }
  friend PortableLanes abs(PortableLanes a) {
    return from([&](int i) { return std::abs(a.v[i]); });
  }
  friend Mask operator<(PortableLanes a, PortableLanes b) {
    return mask_from([&](int i) { return a.v[i] < b.v[i]; });
  }
  friend Mask operator<=(PortableLanes a, PortableLanes b) {
    return mask_from([&](int i) { return a.v[i] <= b.v[i]; });
  }
  friend Mask operator&(Mask a, Mask b) {
    return mask_from([&](int i) { return a.v[i] && b.v[i]; });
  }
  friend Mask operator|(Mask a, Mask b) {
    return mask_from([&](int i) { return a.v[i] || b.v[i]; });
  }
  /// Bit i is lane i.
  friend unsigned bits(Mask m) {
    unsigned result = 0;
    for (int i = 0; i < Width; ++i) result |= (m.v[i] ? 1u : 0u) << i;
    return result;
  }
  friend PortableLanes select(Mask m, PortableLanes a, PortableLanes b) {
    return from([&](int i) { return m.v[i] ? a.v[i] : b.v[i]; });
  }
  /// Of all lanes; none may be NaN.
  friend Scalar smallest(PortableLanes a) {
    Scalar result = a.v[0];
    for (int i = 1; i < Width; ++i) result = a.v[i] < result ? a.v[i] : result;
    return result;
  }
  friend Scalar largest(PortableLanes a) { return -smallest(PortableLanes(Scalar(0)) - a); }
  /// Writes the sums over the lanes of a, b, c and d to p[0] … p[3]: of neighbours first, then of
  /// neighbouring sums, and so on.
  friend void store_sums(PortableLanes a, PortableLanes b, PortableLanes c, PortableLanes d,
                         Scalar* p) {
    const auto sum = [](PortableLanes x) {
      for (int step = 1; step < Width; step *= 2) {
        for (int i = 0; i + step < Width; i += 2 * step) x.v[i] += x.v[i + step];
      }
      return x.v[0];
    };
    p[0] = sum(a);
    p[1] = sum(b);
    p[2] = sum(c);
    p[3] = sum(d);
  }
  /// 2ⁿ from a float 1.5 · 2²³ + n, whose low bits are n.
  friend PortableLanes power_of_two(PortableLanes shifted) {
    return from([&](int i) {
      std::uint32_t bits;
      std::memcpy(&bits, &shifted.v[i], sizeof(bits));
      bits = (bits << 23) + 0x3F800000u;
      Scalar r;
      std::memcpy(&r, &bits, sizeof(bits));
      return r;
    });
  }
};

#if defined(__AVX2__) && defined(__FMA__)
/// Eight floats.
struct Avx2Lanes {
  using Scalar = float;
  static constexpr int kWidth = 8;
  struct Mask {
    __m256 v;
  };
  __m256 v;

  Avx2Lanes() = default;
  explicit Avx2Lanes(float s) : v(_mm256_set1_ps(s)) {}
  explicit Avx2Lanes(__m256 x) : v(x) {}
  static Avx2Lanes load(const float* p) { return Avx2Lanes(_mm256_load_ps(p)); }
  void store(float* p) const { _mm256_store_ps(p, v); }

  friend Avx2Lanes operator+(Avx2Lanes a, Avx2Lanes b) {
    return Avx2Lanes(_mm256_add_ps(a.v, b.v));
  }
  friend Avx2Lanes operator-(Avx2Lanes a, Avx2Lanes b) {
    return Avx2Lanes(_mm256_sub_ps(a.v, b.v));
  }
  friend Avx2Lanes operator*(Avx2Lanes a, Avx2Lanes b) {
    return Avx2Lanes(_mm256_mul_ps(a.v, b.v));
  }
  friend Avx2Lanes operator/(Avx2Lanes a, Avx2Lanes b) {
    return Avx2Lanes(_mm256_div_ps(a.v, b.v));
  }
  friend Avx2Lanes fma(Avx2Lanes a, Avx2Lanes b, Avx2Lanes c) {
    return Avx2Lanes(_mm256_fmadd_ps(a.v, b.v, c.v));
  }
  friend Avx2Lanes fnma(Avx2Lanes a, Avx2Lanes b, Avx2Lanes c) {
    return Avx2Lanes(_mm256_fnmadd_ps(a.v, b.v, c.v));
  }
  friend Avx2Lanes min(Avx2Lanes a, Avx2Lanes b) { return Avx2Lanes(_mm256_min_ps(a.v, b.v)); }
  friend Avx2Lanes max(Avx2Lanes a, Avx2Lanes b) { return Avx2Lanes(_mm256_max_ps(a.v, b.v)); }
  friend Avx2Lanes sqrt(Avx2Lanes a) { return Avx2Lanes(_mm256_sqrt_ps(a.v)); }
  friend Avx2Lanes abs(Avx2Lanes a) {
    return Avx2Lanes(_mm256_andnot_ps(_mm256_set1_ps(-0.0f), a.v));
  }
  friend Mask operator<(Avx2Lanes a, Avx2Lanes b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)}; }
  friend Mask operator<=(Avx2Lanes a, Avx2Lanes b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)}; }
  friend Mask operator&(Mask a, Mask b) { return {_mm256_and_ps(a.v, b.v)}; }
  friend Mask operator|(Mask a, Mask b) { return {_mm256_or_ps(a.v, b.v)}; }
  friend unsigned bits(Mask m) { return static_cast<unsigned>(_mm256_movemask_ps(m.v)); }
  friend Avx2Lanes select(Mask m, Avx2Lanes a, Avx2Lanes b) {
    return Avx2Lanes(_mm256_blendv_ps(b.v, a.v, m.v));
  }
  friend float smallest(Avx2Lanes a) {
    __m128 x = _mm_min_ps(_mm256_castps256_ps128(a.v), _mm256_extractf128_ps(a.v, 1));
    x = _mm_min_ps(x, _mm_movehl_ps(x, x));
    return _mm_cvtss_f32(_mm_min_ss(x, _mm_movehdup_ps(x)));
  }
  friend float largest(Avx2Lanes a) { return -smallest(Avx2Lanes(0.0f) - a); }
  friend void store_sums(Avx2Lanes a, Avx2Lanes b, Avx2Lanes c, Avx2Lanes d, float* p) {
    const __m256 sums = _mm256_hadd_ps(_mm256_hadd_ps(a.v, b.v), _mm256_hadd_ps(c.v, d.v));
    _mm_storeu_ps(p, _mm_add_ps(_mm256_castps256_ps128(sums), _mm256_extractf128_ps(sums, 1)));
  }
  friend Avx2Lanes power_of_two(Avx2Lanes shifted) {
    const __m256i bits = _mm256_slli_epi32(_mm256_castps_si256(shifted.v), 23);
    return Avx2Lanes(_mm256_castsi256_ps(_mm256_add_epi32(bits, _mm256_set1_epi32(0x3F800000))));
  }
};
#endif

#if defined(__AVX512F__) && defined(__AVX512DQ__)
/// Sixteen floats.
struct Avx512Lanes {
  using Scalar = float;
  static constexpr int kWidth = 16;
  struct Mask {
    __mmask16 v;
  };
  __m512 v;

  Avx512Lanes() = default;
  explicit Avx512Lanes(float s) : v(_mm512_set1_ps(s)) {}
  explicit Avx512Lanes(__m512 x) : v(x) {}
  static Avx512Lanes load(const float* p) { return Avx512Lanes(_mm512_load_ps(p)); }
  void store(float* p) const { _mm512_store_ps(p, v); }

  friend Avx512Lanes operator+(Avx512Lanes a, Avx512Lanes b) {
    return Avx512Lanes(_mm512_add_ps(a.v, b.v));
  }
  friend Avx512Lanes operator-(Avx512Lanes a, Avx512Lanes b) {
    return Avx512Lanes(_mm512_sub_ps(a.v, b.v));
  }
  friend Avx512Lanes operator*(Avx512Lanes a, Avx512Lanes b) {
    return Avx512Lanes(_mm512_mul_ps(a.v, b.v));
  }
  friend Avx512Lanes operator/(Avx512Lanes a, Avx512Lanes b) {
    return Avx512Lanes(_mm512_div_ps(a.v, b.v));
  }
  friend Avx512Lanes fma(Avx512Lanes a, Avx512Lanes b, Avx512Lanes c) {
    return Avx512Lanes(_mm512_fmadd_ps(a.v, b.v, c.v));
  }
  friend Avx512Lanes fnma(Avx512Lanes a, Avx512Lanes b, Avx512Lanes c) {
    return Avx512Lanes(_mm512_fnmadd_ps(a.v, b.v, c.v));
  }
  friend Avx512Lanes min(Avx512Lanes a, Avx512Lanes b) {
    return Avx512Lanes(_mm512_min_ps(a.v, b.v));
  }
  friend Avx512Lanes max(Avx512Lanes a, Avx512Lanes b) {
    return Avx512Lanes(_mm512_max_ps(a.v, b.v));
  }
  friend Avx512Lanes sqrt(Avx512Lanes a) { return Avx512Lanes(_mm512_sqrt_ps(a.v)); }
  friend Avx512Lanes abs(Avx512Lanes a) { return Avx512Lanes(_mm512_abs_ps(a.v)); }
  friend Mask operator<(Avx512Lanes a, Avx512Lanes b) {
    return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)};
  }
  friend Mask operator<=(Avx512Lanes a, Avx512Lanes b) {
    return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ)};
  }
  friend Mask operator&(Mask a, Mask b) { return {static_cast<__mmask16>(a.v & b.v)}; }
  friend Mask operator|(Mask a, Mask b) { return {static_cast<__mmask16>(a.v | b.v)}; }
  friend unsigned bits(Mask m) { return m.v; }
  friend Avx512Lanes select(Mask m, Avx512Lanes a, Avx512Lanes b) {
    return Avx512Lanes(_mm512_mask_blend_ps(m.v, b.v, a.v));
  }
  friend float smallest(Avx512Lanes a) { return _mm512_reduce_min_ps(a.v); }
  friend float largest(Avx512Lanes a) { return _mm512_reduce_max_ps(a.v); }
  friend Avx512Lanes power_of_two(Avx512Lanes shifted) {
    const __m512i bits = _mm512_slli_epi32(_mm512_castps_si512(shifted.v), 23);
    return Avx512Lanes(_mm512_castsi512_ps(_mm512_add_epi32(bits, _mm512_set1_epi32(0x3F800000))));
  }
};
#endif

/// eˣ to 1e-7 relative for x ≤ 88; 0 below −87, where the result would be denormal.
template <typename Lanes>
inline Lanes exp(Lanes x) {
  if constexpr (sizeof(typename Lanes::Scalar) == sizeof(double)) {
    return Lanes::from([&](int i) { return std::exp(x.v[i]); });
  } else {
    // x = n ln 2 + r with |r| ≤ ln 2 / 2; ln 2 in two parts, of which the first has few bits.
    const Lanes clamped = max(min(x, Lanes(88.0f)), Lanes(-87.0f));
    const Lanes shifted = fma(clamped, Lanes(1.44269504f), Lanes(12582912.0f));
    const Lanes n = shifted - Lanes(12582912.0f);
    const Lanes r = fnma(n, Lanes(-2.12194440e-4f), fnma(n, Lanes(0.693359375f), clamped));
    Lanes series = fma(r, Lanes(1.0f / 5040.0f), Lanes(1.0f / 720.0f));
    series = fma(series, r, Lanes(1.0f / 120.0f));
    series = fma(series, r, Lanes(1.0f / 24.0f));
    series = fma(series, r, Lanes(1.0f / 6.0f));
    series = fma(series, r, Lanes(0.5f));
    series = fma(series, r, Lanes(1.0f));
    series = fma(series, r, Lanes(1.0f));
    return select(x < Lanes(-87.0f), Lanes(0.0f), series * power_of_two(shifted));
  }
}

}  // namespace
}  // namespace gdfmap
