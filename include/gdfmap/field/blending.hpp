#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/field/partition_of_unity.hpp>

namespace gdfmap {

/// Where the same cubes share every point. Along each axis that is either the inside of one cube,
/// farther than the margin from its faces, or the band of the margin on both sides of a face.
struct BlendZone {
  int level = 0;
  /// Along each axis 2c + 1 inside cube c, and 2c around the face between the cubes c − 1 and c.
  std::array<std::int64_t, 3> half_cubes{};

  /// The first of the cubes along an axis, and how many there are: 1 or 2.
  [[nodiscard]] static std::int64_t first_cube(std::int64_t half_cube) {
    return (half_cube - 1) >> 1;
  }
  [[nodiscard]] static std::size_t num_cubes(std::int64_t half_cube) {
    return half_cube % 2 == 0 ? 2 : 1;
  }
  /// A coordinate from the lower face of the first of them.
  /// @param edge  of a cube, in the same unit
  [[nodiscard]] static double p_local(std::int64_t half_cube, double along_axis, double edge) {
    return along_axis - static_cast<double>(first_cube(half_cube)) * edge;
  }
  [[nodiscard]] bool operator==(const BlendZone& other) const {
    return level == other.level && half_cubes[0] == other.half_cubes[0] &&
           half_cubes[1] == other.half_cubes[1] && half_cubes[2] == other.half_cubes[2];
  }
};

/// Keeps the band of a model that states no margin from having no width.
inline constexpr double kMinMarginRatio = 1e-6;

/// The margin that cubes of this edge are blended with where `margin` is asked for: two cubes share
/// a point along an axis, never three.
[[nodiscard]] inline double partition_margin(double margin, double edge) {
  return std::clamp(margin, kMinMarginRatio * edge, 0.5 * edge);
}

/// The zones of a level.
class BlendZones {
 public:
  /// @param edge    of a cube, metres
  /// @param margin  half the width of a band, metres, above 0 and at most half of the edge
  BlendZones(int level, double edge, double margin)
      : level_(level),
        edge_(edge),
        margin_(margin),
        cubes_per_metre_(1.0 / edge),
        band_(margin / edge) {}

  [[nodiscard]] double edge() const { return edge_; }
  [[nodiscard]] double margin() const { return margin_; }

  /// The zone that holds a point; nothing where a coordinate is not finite or beyond the lattice.
  [[nodiscard]] std::optional<BlendZone> zone_of(const Vector3& p_world) const {
    const Vector3 cubes = p_world * cubes_per_metre_;
    constexpr double kEnd = static_cast<double>(kMaxTileCoordinate) * kCubesPerTileAxis;
    // NaN fails every comparison.
    if (!(std::abs(cubes.x()) < kEnd && std::abs(cubes.y()) < kEnd && std::abs(cubes.z()) < kEnd)) {
      return std::nullopt;
    }
    return BlendZone{level_,
                     {half_cube_of(cubes.x()), half_cube_of(cubes.y()), half_cube_of(cubes.z())}};
  }
  /// Of a coordinate in metres that is on the lattice.
  [[nodiscard]] std::int64_t half_cube(double along_axis) const {
    return half_cube_of(along_axis * cubes_per_metre_);
  }
  /// The cubes of a coordinate's zone with their weights there.
  [[nodiscard]] AxisBlend<double> blend(std::int64_t half_cube, double along_axis) const {
    return axis_blend(BlendZone::num_cubes(half_cube),
                      BlendZone::p_local(half_cube, along_axis, edge_), edge_, margin_);
  }

 private:
  [[nodiscard]] std::int64_t half_cube_of(double cubes) const {
    const std::int64_t cube = floor_to_integer(cubes);
    const double inside = cubes - static_cast<double>(cube);
    return 2 * cube + static_cast<std::int64_t>(inside >= band_) +
           static_cast<std::int64_t>(inside > 1.0 - band_);
  }

  int level_;
  double edge_, margin_;
  double cubes_per_metre_;
  double band_;
};

/// Calls visit(cube) for the cubes that share the points of a zone, at most 8, in key order.
template <typename Visit>
void visit_cubes(const BlendZone& zone, const Visit& visit) {
  const auto first = [&zone](std::size_t a) { return BlendZone::first_cube(zone.half_cubes[a]); };
  const auto end = [&](std::size_t a) {
    return first(a) + static_cast<std::int64_t>(BlendZone::num_cubes(zone.half_cubes[a]));
  };
  for (std::int64_t x = first(0); x < end(0); ++x) {
    for (std::int64_t y = first(1); y < end(1); ++y) {
      for (std::int64_t z = first(2); z < end(2); ++z) visit(CubeKey{zone.level, x, y, z});
    }
  }
}

/// The ancestor's weight of a cube, for comparison: smoothstep(1 + signed distance to the nearest
/// face / margin), to be normalised over all cubes that share a point. Not differentiable on
/// diagonals near edges; evaluate_gdf1 of robotics-upo/G-EDF defines it.
[[nodiscard]] double gdf1_blend_weight(const Vector3& p_local, double edge, double margin);

}  // namespace gdfmap
