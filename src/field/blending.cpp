#include <algorithm>

#include <gdfmap/field/blending.hpp>

namespace gdfmap {

double smoothstep(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

AxisBlend axis_blend(double u, double edge, double margin) {
  const bool low = u < margin;
  if (!low && u <= edge - margin) return {};
  // Signed distance inside the cube from the face that is shared, as a fraction of the blending
  // band.
  const double inside = low ? u : edge - u;
  const double t = std::clamp((inside + margin) / (2.0 * margin), 0.0, 1.0);
  const double slope = 6.0 * t * (1.0 - t) / (2.0 * margin);
  return {low ? -1 : 1, smoothstep(t), low ? slope : -slope};
}

BlendTerms partition_of_unity(const CubeKey& own, const Vector3& origin, const Vector3& p_world,
                              double edge, double margin) {
  const Vector3 p_local = p_world - origin;
  std::array<AxisBlend, 3> axes;
  std::array<std::array<int, 2>, 3> offsets;  // ascending, so that terms come in key order
  std::array<int, 3> counts;
  for (std::size_t a = 0; a < 3; ++a) {
    axes[a] = axis_blend(p_local[static_cast<Eigen::Index>(a)], edge, margin);
    const int side = axes[a].side;
    offsets[a] = {std::min(side, 0), std::max(side, 0)};
    counts[a] = side == 0 ? 1 : 2;
  }
  BlendTerms result;
  for (int i = 0; i < counts[0]; ++i) {
    for (int j = 0; j < counts[1]; ++j) {
      for (int k = 0; k < counts[2]; ++k) {
        const std::array<int, 3> at = {offsets[0][static_cast<std::size_t>(i)],
                                       offsets[1][static_cast<std::size_t>(j)],
                                       offsets[2][static_cast<std::size_t>(k)]};
        const Vector3 w(axes[0].weight(at[0]), axes[1].weight(at[1]), axes[2].weight(at[2]));
        BlendTerm& term = result.terms[static_cast<std::size_t>(result.count++)];
        term.cube = {own.level, own.x + at[0], own.y + at[1], own.z + at[2]};
        term.weight = w.prod();
        term.weight_gradient = {axes[0].derivative(at[0]) * w.y() * w.z(),
                                w.x() * axes[1].derivative(at[1]) * w.z(),
                                w.x() * w.y() * axes[2].derivative(at[2])};
      }
    }
  }
  return result;
}

double gdf1_blend_weight(const Vector3& p_local, double edge, double margin) {
  const double nearest_face =
      std::min(p_local.minCoeff(), (Vector3::Constant(edge) - p_local).minCoeff());
  return smoothstep(1.0 + nearest_face / margin);
}

}  // namespace gdfmap
