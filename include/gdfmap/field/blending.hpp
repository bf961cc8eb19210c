#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/lattice.hpp>

namespace gdfmap {

/// 0 for t ≤ 0, 1 for t ≥ 1, 3t² − 2t³ between.
[[nodiscard]] inline double smoothstep(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// The cubes that share a point along one axis, in ascending order: the one that holds it and,
/// within `margin` of a face, the one behind that face. Their weights sum to 1 and are C¹ across
/// the face.
struct AxisBlend {
  int count = 0;  ///< 1 or 2; the rest of the arrays is not set
  std::array<std::int64_t, 2> cube;
  std::array<double, 2> p_local;  ///< position from the cube's lower face, metres
  std::array<double, 2> weight;
  std::array<double, 2> derivative;  ///< of the weight, 1/m
};

/// @param cube  the one that holds p along the axis
/// @param p     world coordinate, metres
[[nodiscard]] inline AxisBlend axis_blend(std::int64_t cube, double p, double edge, double margin) {
  AxisBlend axis;
  const double u = p - static_cast<double>(cube) * edge;
  const bool low = u < 0.5 * edge;
  // Signed distance inside the cube from the nearer face, as a fraction of the blending band.
  const double inside = low ? u : edge - u;
  if (inside >= margin) {
    axis.count = 1;
    axis.cube[0] = cube;
    axis.p_local[0] = u;
    axis.weight[0] = 1.0;
    axis.derivative[0] = 0.0;
    return axis;
  }
  const double t = std::clamp((inside + margin) / (2.0 * margin), 0.0, 1.0);
  const double own = smoothstep(t);
  const double slope = 6.0 * t * (1.0 - t) / (2.0 * margin);
  const std::int64_t first = low ? cube - 1 : cube;
  axis.count = 2;
  axis.cube = {first, first + 1};
  axis.p_local = {p - static_cast<double>(first) * edge, p - static_cast<double>(first + 1) * edge};
  axis.weight[0] = low ? 1.0 - own : own;
  axis.weight[1] = low ? own : 1.0 - own;
  axis.derivative = {-slope, slope};
  return axis;
}

/// One cube's share in the blended field at a point.
struct BlendTerm {
  CubeKey cube;
  Vector3 p_local;          ///< the point from the cube's minimum corner, metres
  double weight;            ///< positive
  Vector3 weight_gradient;  ///< 1/m
};

/// The separable partition of unity: at most 8 cubes share a point, and their weights sum to 1.
/// Where cubes are missing the caller gives what is left to the next level. Calls `visit` with each
/// term in key order, until it returns false; returns what it returned last.
/// @param own  the cube that holds p_world
template <typename Visit>
bool visit_partition_of_unity(const CubeKey& own, const Vector3& p_world, double edge,
                              double margin, const Visit& visit) {
  const AxisBlend x = axis_blend(own.x, p_world.x(), edge, margin);
  const AxisBlend y = axis_blend(own.y, p_world.y(), edge, margin);
  const AxisBlend z = axis_blend(own.z, p_world.z(), edge, margin);
  for (std::size_t i = 0; i < static_cast<std::size_t>(x.count); ++i) {
    for (std::size_t j = 0; j < static_cast<std::size_t>(y.count); ++j) {
      const double weight_xy = x.weight[i] * y.weight[j];
      for (std::size_t k = 0; k < static_cast<std::size_t>(z.count); ++k) {
        const double weight = weight_xy * z.weight[k];
        if (weight == 0.0) continue;
        const BlendTerm term{
            {own.level, x.cube[i], y.cube[j], z.cube[k]},
            {x.p_local[i], y.p_local[j], z.p_local[k]},
            weight,
            {x.derivative[i] * y.weight[j] * z.weight[k],
             x.weight[i] * y.derivative[j] * z.weight[k], weight_xy * z.derivative[k]}};
        if (!visit(term)) return false;
      }
    }
  }
  return true;
}

/// The ancestor's weight of a cube, for comparison: smoothstep(1 + signed distance to the nearest
/// face / margin), to be normalised over all cubes that share a point. Not differentiable on
/// diagonals near edges; evaluate_gdf1 of robotics-upo/G-EDF defines it.
[[nodiscard]] double gdf1_blend_weight(const Vector3& p_local, double edge, double margin);

}  // namespace gdfmap
