#pragma once

#include <span>
#include <vector>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/query/distance_field.hpp>

namespace gdfmap {

// Questions about lines. A distance changes by at most a metre a metre, so that nothing is within
// conservative_distance() of a place: each walk steps as far as that allows, and by the tolerance
// where it allows nothing. Where a field knows no error bounds (an imported model), the distance
// itself takes their place, and what rests on bounds is NaN. Answers do not depend on the number of
// walks that are asked for together.

/// How a path is looked at. Lengths in metres.
struct PathOptions {
  double radius = 0.0;      ///< of the robot
  double tolerance = 0.01;  ///< least step
};

/// Clearance along a polyline. Lengths in metres, from the path's first point.
struct PathClearance {
  double length = 0.0;
  /// The least distance of the field at any place looked at; NaN when nothing is known of the path.
  double distance = 0.0;
  Vector3 place = Vector3::Zero();             ///< where that is, world frame
  double place_at = 0.0;                       ///< the same along the path
  FieldStatus status = FieldStatus::kUnknown;  ///< of the answer there
  /// The true distance is not below this anywhere on the known part of the path, as far as
  /// conservative_distance() can be trusted; at most half a tolerance below the least of those.
  double lower_bound = 0.0;
  /// Up to here the robot's centre may go: all is known, and every conservative distance is more
  /// than the radius.
  double free_length = 0.0;
  bool is_free = false;  ///< the same of the whole path
  /// Of the parts of which the field knows nothing, to a quarter of a cube.
  double unknown_length = 0.0;
};

/// @param path_world  corners of a polyline; one point is a path of no length
/// @throws Error kUsage for a path without points, points that are not finite, or options that are
///         not finite numbers of metres (radius from 0, tolerance above 0)
[[nodiscard]] PathClearance clearance_along(const DistanceField& field,
                                            std::span<const Vector3> path_world,
                                            const PathOptions& options = {});
/// The same for many, in parallel.
[[nodiscard]] std::vector<PathClearance> clearances_along(
    const DistanceField& field, std::span<const std::vector<Vector3>> paths_world,
    const PathOptions& options = {});

struct Ray {
  Vector3 origin_world;
  Vector3 direction_world;  ///< of any length
};

/// How rays are cast. Lengths in metres.
struct RayOptions {
  double max_range = 100.0;
  /// Of the beam: it ends where the distance is no more. Points have no surface, so it should be
  /// more than their spacing and than the expected error of the field.
  double radius = 0.05;
  double tolerance = 0.01;  ///< least step
};

/// Why a ray ends.
enum class RayEnd {
  kHit,       ///< the distance fell to the radius
  kMaxRange,  ///< nothing was met
  kUnknown    ///< the field does not know what comes next
};

struct RayHit {
  RayEnd end = RayEnd::kUnknown;
  double range = 0.0;  ///< from the origin to where it ends, metres
  /// Up to here every conservative distance is more than the radius.
  double free_range = 0.0;
  Vector3 place = Vector3::Zero();  ///< where it ends, world frame
  /// The answer there. A hit that is kFar is one with a lower bound: something may be there.
  FieldSample sample;
};

/// @throws Error kUsage for an origin that is not finite, a direction that is not or is zero, or
///         options that are not finite numbers of metres (radius from 0, the others above 0)
[[nodiscard]] RayHit cast_ray(const DistanceField& field, const Ray& ray,
                              const RayOptions& options = {});
/// The same for many, in parallel.
[[nodiscard]] std::vector<RayHit> cast_rays(const DistanceField& field, std::span<const Ray> rays,
                                            const RayOptions& options = {});

}  // namespace gdfmap
