#pragma once

// The blended field at the points of a packet, written once for any lane type (src/core/lanes.hpp).
// Blending has points in the lanes. Gaussians are summed with points in the lanes where enough
// points share a cube, and else with the cube's Gaussians in the lanes, a point at a time; both
// add in the same order. Included by one .cpp file per instruction set; everything has internal
// linkage and works on raw arrays.

#include <gdfmap/field/partition_of_unity.hpp>

#include "core/lanes.hpp"
#include "field_kernels.hpp"

namespace gdfmap {
namespace {

/// a·b + c for results that need not be the same everywhere: fused where the processor does that.
template <typename Lanes>
inline Lanes multiply_add(Lanes a, Lanes b, Lanes c) {
  return fma(a, b, c);
}
template <typename Number, int kWidth>
inline PortableLanes<Number, kWidth> multiply_add(PortableLanes<Number, kWidth> a,
                                                  PortableLanes<Number, kWidth> b,
                                                  PortableLanes<Number, kWidth> c) {
  return a * b + c;
}

/// exp(−x/2) for x ≥ 0, to 1e-7 and the rounding of x relative. Never below 2⁻¹⁰⁰, so that no
/// product becomes denormal. Of doubles as the standard library has it.
template <typename Lanes>
inline Lanes exp_minus_half(Lanes x) {
  if constexpr (sizeof(typename Lanes::Scalar) == sizeof(double)) {
    return exp(Lanes(-0.5) * x);
  } else {
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
}

/// Value and gradient of some Gaussians; the gradient with the opposite sign.
template <typename Lanes>
struct GaussianSums {
  Lanes value = Lanes(0), x = Lanes(0), y = Lanes(0), z = Lanes(0);

  /// Adds one Gaussian, or one for each lane: its mean, 1/s⁴ and weight.
  template <bool kGradient>
  void add(const Lanes (&p)[3], const Lanes (&mean)[3], const Lanes (&precision)[3], Lanes weight) {
    const Lanes dx = p[0] - mean[0], dy = p[1] - mean[1], dz = p[2] - mean[2];
    const Lanes sx = dx * precision[0], sy = dy * precision[1], sz = dz * precision[2];
    const Lanes exponent = multiply_add(dz, sz, multiply_add(dy, sy, dx * sx));
    const Lanes v = weight * exp_minus_half(exponent);
    value = value + v;
    if constexpr (kGradient) {
      x = multiply_add(v, sx, x);
      y = multiply_add(v, sy, y);
      z = multiply_add(v, sz, z);
    }
  }
  template <bool kGradient>
  void add(const GaussianSums& other) {
    value = value + other.value;
    if constexpr (kGradient) {
      x = x + other.x;
      y = y + other.y;
      z = z + other.z;
    }
  }
};

/// Σ w·d_c over the cubes of a partition of unity.
template <typename Lanes, bool kGradient>
class WeightedSum {
 public:
  void add(const KernelCube& cube, const BlendTerm<Lanes>& term, const GaussianSums<Lanes>& sums) {
    distance_ = multiply_add(term.weight, sums.value, distance_);
    weight_ = weight_ + term.weight;
    mae_ = multiply_add(term.weight, Lanes(cube.mae), mae_);
    max_error_ = multiply_add(term.weight, Lanes(cube.max_error), max_error_);
    if constexpr (kGradient) {
      const Lanes slopes[3] = {sums.x, sums.y, sums.z};
      for (int a = 0; a < 3; ++a) {
        minus_gradient_[a] = multiply_add(
            term.weight, slopes[a], minus_gradient_[a] - term.weight_gradient[a] * sums.value);
      }
    }
  }
  void store(std::size_t first, KernelSums<typename Lanes::Scalar>& sums) const {
    distance_.store(sums.distance + first);
    weight_.store(sums.weight + first);
    mae_.store(sums.mae + first);
    max_error_.store(sums.max_error + first);
    if constexpr (kGradient) {
      for (int a = 0; a < 3; ++a) (Lanes(0) - minus_gradient_[a]).store(sums.gradient[a] + first);
    }
  }

 private:
  Lanes distance_ = Lanes(0), weight_ = Lanes(0), mae_ = Lanes(0), max_error_ = Lanes(0);
  Lanes minus_gradient_[3] = {Lanes(0), Lanes(0), Lanes(0)};
};

/// What finer levels leave to coarser ones: d = Σ w·d_c + (1 − Σ w) · (the same of the next level),
/// from the finest level down. The share is the product of their (1 − Σ w), each taken as the sum
/// over the missing cubes, so that it is exactly zero where none is.
template <typename Lanes>
class Share {
 public:
  /// The share of a cube of the present level.
  [[nodiscard]] BlendTerm<Lanes> operator*(BlendTerm<Lanes> term) const {
    if (is_all_) return term;
    for (int a = 0; a < 3; ++a) {
      term.weight_gradient[a] =
          multiply_add(share_, term.weight_gradient[a], term.weight * gradient_[a]);
    }
    term.weight = term.weight * share_;
    return term;
  }
  void add_missing(const BlendTerm<Lanes>& term) {
    missing_ = missing_ + term.weight;
    for (int a = 0; a < 3; ++a) {
      missing_gradient_[a] = missing_gradient_[a] + term.weight_gradient[a];
    }
  }
  void finish_level() {
    const BlendTerm<Lanes> left =
        *this *
        BlendTerm<Lanes>{
            {}, missing_, {missing_gradient_[0], missing_gradient_[1], missing_gradient_[2]}};
    is_all_ = false;
    share_ = left.weight;
    missing_ = Lanes(0);
    for (int a = 0; a < 3; ++a) {
      gradient_[a] = left.weight_gradient[a];
      missing_gradient_[a] = Lanes(0);
    }
  }
  void store(std::size_t first, KernelSums<typename Lanes::Scalar>& sums) const {
    share_.store(sums.share + first);
    for (int a = 0; a < 3; ++a) gradient_[a].store(sums.share_gradient[a] + first);
  }

 private:
  bool is_all_ = true;  ///< until a level is finished
  Lanes share_ = Lanes(1);
  Lanes gradient_[3] = {Lanes(0), Lanes(0), Lanes(0)};
  Lanes missing_ = Lanes(0);
  Lanes missing_gradient_[3] = {Lanes(0), Lanes(0), Lanes(0)};
};

template <typename Lanes>
struct FieldArithmetic {
  using Number = typename Lanes::Scalar;
  using Packet = KernelPacket<Number>;
  static constexpr std::size_t kWidth = Lanes::kWidth;
  /// Gaussians k, k + 8, … are added to each other first, and then those eight sums in pairs:
  /// rows are filled up to eight.
  static constexpr std::uint32_t kStride = 8;
  /// Fewer points than this take less time one by one.
  static constexpr std::size_t kMinPointsInLanes = kWidth == kStride ? 5 : 1;

  /// The Gaussians kFirst, kFirst + 8, …, and those of the kCount − 1 next such sums.
  template <bool kGradient, std::uint32_t kFirst = 0, std::uint32_t kCount = kStride>
  static GaussianSums<Lanes> sum_over_points(const KernelCube& cube, const Lanes (&p)[3]) {
    GaussianSums<Lanes> sums;
    if constexpr (kCount == 1) {
      const auto row = [&cube](std::size_t r, std::uint32_t k) {
        return Lanes(static_cast<Number>(cube.rows[r * cube.stride + k]));
      };
      for (std::uint32_t k = kFirst; k < cube.count; k += kStride) {
        const Lanes mean[3] = {row(0, k), row(1, k), row(2, k)};
        const Lanes precision[3] = {row(3, k), row(4, k), row(5, k)};
        sums.template add<kGradient>(p, mean, precision, row(6, k));
      }
    } else {
      constexpr std::uint32_t kHalf = kCount / 2;
      sums = sum_over_points<kGradient, kFirst, kHalf>(cube, p);
      if (kFirst + kHalf < cube.count) {
        sums.template add<kGradient>(sum_over_points<kGradient, kFirst + kHalf, kHalf>(cube, p));
      }
    }
    return sums;
  }

  /// Value and minus the gradient at one point.
  template <bool kGradient>
  static void sum_over_gaussians(const KernelCube& cube, const Lanes (&p)[3], Number (&sums)[4]) {
    GaussianSums<Lanes> lanes;
    const std::size_t stride = cube.stride;
    const float* rows = cube.rows;
    for (std::uint32_t k = 0; k < cube.stride; k += kStride, rows += kStride) {
      const Lanes mean[3] = {Lanes::load(rows), Lanes::load(rows + stride),
                             Lanes::load(rows + 2 * stride)};
      const Lanes precision[3] = {Lanes::load(rows + 3 * stride), Lanes::load(rows + 4 * stride),
                                  Lanes::load(rows + 5 * stride)};
      lanes.template add<kGradient>(p, mean, precision, Lanes::load(rows + 6 * stride));
    }
    if constexpr (kGradient) {
      store_sums(lanes.value, lanes.x, lanes.y, lanes.z, sums);
    } else {
      store_sums(lanes.value, lanes.value, lanes.value, lanes.value, sums);
    }
  }

  template <bool kGradient>
  static GaussianSums<Lanes> sum_one_by_one(const KernelCube& cube, const Lanes (&p)[3],
                                            std::size_t num_points) {
    if (num_points == 1) {
      // All lanes hold the point. Its sums do not pass through memory number by number, for which
      // a load of them all would wait.
      Number of_point[4];
      sum_over_gaussians<kGradient>(cube, p, of_point);
      return {Lanes(of_point[0]), Lanes(of_point[1]), Lanes(of_point[2]), Lanes(of_point[3])};
    }
    alignas(32) Number p_local[3][kWidth];
    for (int a = 0; a < 3; ++a) p[a].store(p_local[a]);
    alignas(32) Number sums[4][kWidth] = {};
    for (std::size_t i = 0; i < num_points; ++i) {
      const Lanes point[3] = {Lanes(p_local[0][i]), Lanes(p_local[1][i]), Lanes(p_local[2][i])};
      Number of_point[4];
      sum_over_gaussians<kGradient>(cube, point, of_point);
      for (int s = 0; s < 4; ++s) sums[s][i] = of_point[s];
    }
    return {Lanes::load(sums[0]), Lanes::load(sums[1]), Lanes::load(sums[2]), Lanes::load(sums[3])};
  }

  template <bool kGradient>
  static GaussianSums<Lanes> sum(const KernelCube& cube, const Lanes (&p)[3],
                                 std::size_t num_points) {
    if constexpr (kMinPointsInLanes > 1) {
      if (num_points < kMinPointsInLanes) return sum_one_by_one<kGradient>(cube, p, num_points);
    }
    return sum_over_points<kGradient>(cube, p);
  }

  /// visit(cube, term) for the cubes of a level, those that are missing included.
  template <typename Visit>
  static void visit_cubes(const KernelLevel& level, const Number (&p_local)[3][kPacketSize],
                          std::size_t first, const Visit& visit) {
    const auto edge = static_cast<Number>(level.edge), margin = static_cast<Number>(level.margin);
    const auto along = [&](int a) {
      return axis_blend(level.counts[a], Lanes::load(p_local[a] + first), edge, margin);
    };
    const KernelCube* next = level.cubes;
    visit_partition_of_unity(along(0), along(1), along(2),
                             [&](const BlendTerm<Lanes>& term) { visit(*next++, term); });
  }

  template <bool kGradient>
  static void evaluate_whole(const Packet& packet, std::size_t first, KernelSums<Number>& sums) {
    WeightedSum<Lanes, kGradient> field;
    const std::size_t num_points = packet.num_points - first;
    const auto add = [&](const KernelCube& cube, const BlendTerm<Lanes>& term) {
      field.add(cube, term, sum<kGradient>(cube, term.p_local, num_points));
    };
    visit_cubes(packet.levels[0], packet.p_local[0], first, add);
    field.store(first, sums);
  }

  template <bool kGradient>
  static void evaluate_levels(const Packet& packet, std::size_t first, KernelSums<Number>& sums) {
    WeightedSum<Lanes, kGradient> field;
    Share<Lanes> share;
    const std::size_t num_points = packet.num_points - first;
    const auto add = [&](const KernelCube& cube, const BlendTerm<Lanes>& term) {
      if (cube.rows == nullptr) return share.add_missing(term);
      field.add(cube, share * term, sum<kGradient>(cube, term.p_local, num_points));
    };
    for (std::size_t level = 0; level < packet.num_levels; ++level) {
      visit_cubes(packet.levels[level], packet.p_local[level], first, add);
      share.finish_level();
    }
    field.store(first, sums);
    share.store(first, sums);
  }

  template <bool kGradient>
  static void evaluate(const Packet& packet, KernelSums<Number>& sums) {
    for (std::size_t first = 0; first < packet.num_points; first += kWidth) {
      if (packet.is_fine) {
        evaluate_whole<kGradient>(packet, first, sums);
      } else {
        evaluate_levels<kGradient>(packet, first, sums);
      }
    }
  }

  static constexpr FieldKernels<Number> table() { return {evaluate<false>, evaluate<true>}; }
};

}  // namespace
}  // namespace gdfmap
