#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <gdfmap/align/kd_tree.hpp>
#include <gdfmap/core/geometry.hpp>

namespace gdfmap {

/// Points relative to a local origin, thinned, each with the normal of the surface around it, and
/// their neighbours. Immutable; thread-safe.
///
/// A voxel keeps the mean of its points. The normal is the direction in which the nearest
/// kNeighbors means vary least; its sign means nothing. The regularised covariance that GICP wants
/// of a point follows from it: kFlatness along the normal and 1 across, no matter how far apart
/// neighbours lie.
class SurfaceCloud {
 public:
  static constexpr int kNeighbors = 10;
  static constexpr double kFlatness = 1e-3;

  /// @param points  metres, local frame; those that are not finite, or more than 2²⁰ voxels from
  ///                the origin along an axis, are left out
  /// @param voxel   edge in metres, positive; 0: every point is kept
  /// @param num_threads  of the normals; changes no bit
  SurfaceCloud(std::span<const Vector3> points, double voxel, int num_threads);

  [[nodiscard]] const std::vector<Vector3>& points() const { return points_; }
  [[nodiscard]] const std::vector<Vector3>& normals() const { return normals_; }
  [[nodiscard]] const KdTree& tree() const { return tree_; }
  [[nodiscard]] std::size_t size() const { return points_.size(); }

 private:
  std::vector<Vector3> points_;
  KdTree tree_;
  std::vector<Vector3> normals_;
};

/// When a point with a normal lies on a surface, seen from the surface's point nearest to it. Where
/// that is farther away than kReach voxels, it does not.
struct OnSurface {
  static constexpr double kReach = 2.0;
  static constexpr double kThickness = 0.4;  ///< most distance along the normal, voxels
  static constexpr double kMinCosine = 0.7;  ///< between the normals, whatever their signs

  /// The distance along the surface's normal, metres; empty where the point lies elsewhere.
  /// @param offset  of the point from the surface's, metres
  [[nodiscard]] static std::optional<double> distance(const Vector3& offset, const Vector3& normal,
                                                      const Vector3& surface_normal, double voxel) {
    const double distance = surface_normal.dot(offset);
    const bool is_off = std::abs(distance) > kThickness * voxel ||
                        std::abs(surface_normal.dot(normal)) < kMinCosine;
    return is_off ? std::nullopt : std::optional(distance);
  }
};

/// The mean of the points of every occupied voxel, in Morton order of the voxels; see SurfaceCloud.
[[nodiscard]] std::vector<Vector3> voxel_means(std::span<const Vector3> points, double voxel);

}  // namespace gdfmap
