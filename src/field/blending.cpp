#include <gdfmap/field/blending.hpp>

namespace gdfmap {

double gdf1_blend_weight(const Vector3& p_local, double edge, double margin) {
  const double nearest_face =
      std::min(p_local.minCoeff(), (Vector3::Constant(edge) - p_local).minCoeff());
  return smoothstep(1.0 + nearest_face / margin);
}

}  // namespace gdfmap
