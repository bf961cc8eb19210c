#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include <gdfmap/align/factor.hpp>
#include <gdfmap/align/rigid_motion.hpp>

namespace gdfmap::test {

/// A pose from numbers of a random sequence: at most `metres` along each axis, `radians` about it.
inline Eigen::Isometry3d random_pose(std::mt19937& random, double metres, double radians) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Twist twist;
  for (int i = 0; i < 6; ++i) twist[i] = (i < 3 ? metres : radians) * unit(random);
  return exp_twist(twist);
}

/// Points of a corner of a room: a floor and two walls of `size` metres, with noise across.
inline std::vector<Vector3> corner_points(std::size_t count, double size, double noise,
                                          std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> along(0.0, size);
  std::normal_distribution<double> across(0.0, 1.0);
  std::vector<Vector3> points(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto axis = static_cast<Eigen::Index>(i % 3);
    points[i] = {along(random), along(random), along(random)};
    points[i][axis] = noise * across(random);
  }
  return points;
}

/// Points of a bumpy surface z = sin(x)·cos(y) without noise, size metres wide.
inline std::vector<Vector3> wave_points(std::size_t count, double size, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> along(-0.5 * size, 0.5 * size);
  std::vector<Vector3> points(count);
  for (Vector3& p : points) {
    p = {along(random), along(random), 0.0};
    p.z() = std::sin(p.x()) * std::cos(p.y());
  }
  return points;
}

inline std::vector<Vector3> moved(const Eigen::Isometry3d& T, std::vector<Vector3> points) {
  for (Vector3& p : points) p = T * p;
  return points;
}

/// The gradient of a factor's cost by central differences of its own retraction.
inline Twist difference_gradient(const Factor& factor, const Eigen::Isometry3d& T,
                                 const RobustKernel& kernel, double h = 1e-6) {
  Twist gradient;
  for (int i = 0; i < 6; ++i) {
    const Twist step = h * Twist::Unit(i);
    gradient[i] = (factor.cost(factor.retract(T, step), kernel) -
                   factor.cost(factor.retract(T, -step), kernel)) /
                  (2.0 * h);
  }
  return gradient;
}

}  // namespace gdfmap::test
