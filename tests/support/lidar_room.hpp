#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap::test {

/// A turning sensor: rings of equal elevation steps, each with as many rays.
struct LidarOptions {
  int num_rings = 64;
  int num_columns = 1024;
  double noise = 0.02;  ///< standard deviation along the ray, metres
};

/// What a lidar sees in a room of 30 × 20 × 5 metres with four pillars and two crates, whose
/// floor's centre is the origin: points in the sensor's frame, in the order of the rays. The same
/// for the same pose, options and seed.
/// @param T_room_sensor  inside the room
[[nodiscard]] std::vector<Vector3> lidar_scan_of_room(const Eigen::Isometry3d& T_room_sensor,
                                                      std::uint32_t seed,
                                                      const LidarOptions& options = {});

/// Two scans of the room whose relative pose is exact.
struct LidarPair {
  std::vector<Vector3> target, source;  ///< each in its sensor's frame
  Eigen::Isometry3d T_target_source;
};
/// Pair `index` of a sequence; the sensor moves by at most 0.5 m and 6 degrees.
[[nodiscard]] LidarPair lidar_pair(std::uint32_t index, const LidarOptions& options = {});

}  // namespace gdfmap::test
