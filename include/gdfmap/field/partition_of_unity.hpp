#pragma once

// The weights with which neighbouring cubes are blended, for any number type with arithmetic, min
// and max: double, or the vector lanes of query's kernels. Knows of no other header, because files
// compiled for one instruction set include it.

#include <algorithm>
#include <cstddef>

namespace gdfmap {

/// 0 for t ≤ 0, 1 for t ≥ 1, 3t² − 2t³ between.
template <typename Number>
[[nodiscard]] inline Number smoothstep(Number t) {
  using std::max, std::min;
  t = min(max(t, Number(0)), Number(1));
  return t * t * (Number(3) - (t + t));
}

/// The one or two cubes that share a point along one axis. The weights of two sum to 1 and are C¹
/// where the band around their common face ends.
template <typename Number>
struct AxisBlend {
  std::size_t count;  ///< 1 or 2; the rest of the arrays is not set
  Number p_local[2];  ///< position from the cube's lower face, metres
  Number weight[2];
  Number derivative[2];  ///< of the weight, 1/m
};

/// @param p_local  position from the lower face of the first cube, metres
/// @param edge     of a cube, metres
/// @param margin   half the width of the band, metres, above 0
template <typename Number, typename Length>
[[nodiscard]] inline AxisBlend<Number> axis_blend(std::size_t count, Number p_local, Length edge,
                                                  Length margin) {
  using std::max, std::min;
  AxisBlend<Number> axis;
  axis.count = count;
  axis.p_local[0] = p_local;
  if (count == 1) {
    axis.weight[0] = Number(1);
    axis.derivative[0] = Number(0);
    return axis;
  }
  axis.p_local[1] = p_local - Number(edge);
  const Number t = (axis.p_local[1] + Number(margin)) * Number(Length(0.5) / margin);
  const Number inside = min(max(t, Number(0)), Number(1));
  axis.weight[1] = smoothstep(t);
  axis.weight[0] = Number(1) - axis.weight[1];
  axis.derivative[1] = inside * (Number(1) - inside) * Number(Length(3) / margin);
  axis.derivative[0] = Number(0) - axis.derivative[1];
  return axis;
}

/// One cube's share in the blended field at a point.
template <typename Number>
struct BlendTerm {
  Number p_local[3];          ///< the point from the cube's minimum corner, metres
  Number weight;              ///< from 0 to 1
  Number weight_gradient[3];  ///< 1/m
};

/// The separable partition of unity: visit(term) for each of the cubes that share a point, x
/// outermost, which is key order. The weights sum to 1.
template <typename Number, typename Visit>
inline void visit_partition_of_unity(const AxisBlend<Number>& x, const AxisBlend<Number>& y,
                                     const AxisBlend<Number>& z, const Visit& visit) {
  for (std::size_t i = 0; i < x.count; ++i) {
    for (std::size_t j = 0; j < y.count; ++j) {
      const Number weight_xy = x.weight[i] * y.weight[j];
      const Number slope_x = x.derivative[i] * y.weight[j];
      const Number slope_y = x.weight[i] * y.derivative[j];
      for (std::size_t k = 0; k < z.count; ++k) {
        visit(BlendTerm<Number>{
            {x.p_local[i], y.p_local[j], z.p_local[k]},
            weight_xy * z.weight[k],
            {slope_x * z.weight[k], slope_y * z.weight[k], weight_xy * z.derivative[k]}});
      }
    }
  }
}

}  // namespace gdfmap
