#pragma once

#include <array>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/lattice.hpp>

namespace gdfmap {

/// 0 for t ≤ 0, 1 for t ≥ 1, 3t² − 2t³ between.
[[nodiscard]] double smoothstep(double t);

/// How two neighbouring cubes share an axis: the cube that holds the point and, within `margin` of
/// a face, the one behind that face. The two weights sum to 1 and are C¹ across the face.
struct AxisBlend {
  int side = 0;      ///< −1 or +1: where the neighbour lies; 0: no neighbour contributes
  double own = 1.0;  ///< weight of the cube that holds the point
  double own_derivative = 0.0;  ///< 1/m; the neighbour's is its negative

  [[nodiscard]] double weight(int offset) const { return offset == 0 ? own : 1.0 - own; }
  [[nodiscard]] double derivative(int offset) const {
    return offset == 0 ? own_derivative : -own_derivative;
  }
};

/// @param u  position along the axis within the cube, in [0, edge]
[[nodiscard]] AxisBlend axis_blend(double u, double edge, double margin);

/// One cube's share in the blended field at a point.
struct BlendTerm {
  CubeKey cube;
  double weight = 0.0;
  Vector3 weight_gradient = Vector3::Zero();  ///< 1/m
};

/// The separable partition of unity: at most 8 cubes share a point and their weights sum to 1.
/// Where cubes are missing the caller gives what is left to the next level. Terms are in key order.
struct BlendTerms {
  std::array<BlendTerm, 8> terms;
  int count = 0;
};

/// @param own     the cube that holds p_world
/// @param origin  its minimum corner, world frame
[[nodiscard]] BlendTerms partition_of_unity(const CubeKey& own, const Vector3& origin,
                                            const Vector3& p_world, double edge, double margin);

/// The ancestor's weight of a cube, for comparison: smoothstep(1 + signed distance to the nearest
/// face / margin), to be normalised over all cubes that share a point. Not differentiable on
/// diagonals near edges; evaluate_gdf1 of robotics-upo/G-EDF defines it.
[[nodiscard]] double gdf1_blend_weight(const Vector3& p_local, double edge, double margin);

}  // namespace gdfmap
