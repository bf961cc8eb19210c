#include "support/lidar_room.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace gdfmap::test {
namespace {

const Box3 kRoom(Vector3(-15, -10, 0), Vector3(15, 10, 5));
const std::array<Box3, 6> kObjects = {Box3(Vector3(-8.0, -5.0, 0), Vector3(-7.4, -4.4, 5)),
                                      Box3(Vector3(7.4, -5.0, 0), Vector3(8, -4.4, 5)),
                                      Box3(Vector3(-8.0, 4.4, 0), Vector3(-7.4, 5.0, 5)),
                                      Box3(Vector3(7.4, 4.4, 0), Vector3(8, 5, 5)),
                                      Box3(Vector3(-3.0, 6.0, 0), Vector3(-1.0, 8.5, 1.5)),
                                      Box3(Vector3(3.0, -9.0, 0), Vector3(6, -7, 2))};
constexpr double kLowest = -25.0, kHighest = 20.0;  // degrees of elevation

/// Where a ray crosses a box: the distances of entry and exit; entry > exit where it misses.
struct Crossing {
  double entry, exit;
};
Crossing cross(const Box3& box, const Vector3& origin, const Vector3& direction) {
  Crossing c{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  for (Eigen::Index a = 0; a < 3; ++a) {
    const double t0 = (box.min()[a] - origin[a]) / direction[a];
    const double t1 = (box.max()[a] - origin[a]) / direction[a];
    c.entry = std::max(c.entry, std::min(t0, t1));
    c.exit = std::min(c.exit, std::max(t0, t1));
  }
  return c;
}

double range_along(const Vector3& origin, const Vector3& direction) {
  double range = cross(kRoom, origin, direction).exit;
  for (const Box3& box : kObjects) {
    const Crossing c = cross(box, origin, direction);
    if (c.entry <= c.exit && c.entry > 0.0) range = std::min(range, c.entry);
  }
  return range;
}

Eigen::Isometry3d pose(const Vector3& translation, const Vector3& rotation) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  const double angle = rotation.norm();
  if (angle > 0.0) T.linear() = Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix();
  T.translation() = translation;
  return T;
}

}  // namespace

std::vector<Vector3> lidar_scan_of_room(const Eigen::Isometry3d& T_room_sensor, std::uint32_t seed,
                                        const LidarOptions& options) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, options.noise);
  const double degree = std::numbers::pi / 180.0;
  std::vector<Vector3> points;
  for (int ring = 0; ring < options.num_rings; ++ring) {
    const double elevation =
        degree * (kLowest + (kHighest - kLowest) * ring / (options.num_rings - 1));
    for (int column = 0; column < options.num_columns; ++column) {
      const double azimuth = 2.0 * std::numbers::pi * column / options.num_columns;
      const Vector3 ray(std::cos(elevation) * std::cos(azimuth),
                        std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const double range = range_along(T_room_sensor.translation(), T_room_sensor.linear() * ray);
      points.push_back((range + noise(random)) * ray);
    }
  }
  return points;
}

LidarPair lidar_pair(std::uint32_t index, const LidarOptions& options) {
  std::mt19937 random(1000 + index);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto in_ball = [&] {
    Vector3 v;
    do {
      v = {unit(random), unit(random), unit(random)};
    } while (v.norm() > 1.0);
    return v;
  };
  const double turn = std::numbers::pi * unit(random);
  const Eigen::Isometry3d T_room_target =
      pose({5.0 * unit(random), 3.0 * unit(random), 1.5 + 0.3 * unit(random)}, {0.0, 0.0, turn});
  LidarPair pair;
  const Vector3 translation = 0.5 * in_ball();
  pair.T_target_source = pose(translation, 6.0 * std::numbers::pi / 180.0 * in_ball());
  pair.target = lidar_scan_of_room(T_room_target, 2 * index, options);
  pair.source = lidar_scan_of_room(T_room_target * pair.T_target_source, 2 * index + 1, options);
  return pair;
}

}  // namespace gdfmap::test
