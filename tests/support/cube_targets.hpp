#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/edt/sample_lattice.hpp>
#include <gdfmap/fit/cube_fit.hpp>

namespace gdfmap::test {

/// Samples of a unit cube at the origin of some distance function.
struct CubeTargets {
  bool populated;
  std::vector<float> targets, held_out;  ///< on the grid of its class

  explicit CubeTargets(const std::function<double(const Vector3&)>& distance,
                       bool is_populated = true, double edge = 1.0)
      : populated(is_populated) {
    const TrainingGrid& grid = training_grid(populated);
    const int per_axis = grid.per_axis();
    for (int x = 0; x < per_axis; ++x) {
      for (int y = 0; y < per_axis; ++y) {
        for (int z = 0; z < per_axis; ++z) {
          const Vector3 p(grid.position(x), grid.position(y), grid.position(z));
          targets.push_back(static_cast<float>(distance(edge * p)));
        }
      }
    }
    for (int x = 0; x < grid.held_out; ++x) {
      for (int y = 0; y < grid.held_out; ++y) {
        for (int z = 0; z < grid.held_out; ++z) {
          const Vector3 p(grid.held_out_position(x, 0), grid.held_out_position(y, 0),
                          grid.held_out_position(z, 0));
          held_out.push_back(static_cast<float>(distance(edge * p)));
        }
      }
    }
  }

  [[nodiscard]] CubeSamples samples(double edge = 1.0) const {
    return {targets, held_out, 0, edge, populated};
  }
  [[nodiscard]] CubeProblem problem() const { return {targets, 1.0, training_grid(populated)}; }
};

/// Distance to the nearest of a few planes through random places: creases like those of real
/// scenes.
[[nodiscard]] inline std::function<double(const Vector3&)> planes_distance(unsigned seed) {
  struct Plane {
    Vector3 normal;
    double offset;
  };
  std::vector<Plane> planes;
  std::uint64_t state = seed * 2654435761u + 1;
  const auto uniform = [&] {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state >> 11) / 9007199254740992.0;
  };
  const int count = 1 + static_cast<int>(seed % 4);
  for (int i = 0; i < count; ++i) {
    const Vector3 normal = Vector3(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5).normalized();
    planes.push_back({normal, normal.dot(Vector3(uniform(), uniform(), uniform()))});
  }
  return [planes](const Vector3& p) {
    double least = 1e9;
    for (const Plane& plane : planes) {
      least = std::min(least, std::abs(plane.normal.dot(p) - plane.offset));
    }
    return least;
  };
}

}  // namespace gdfmap::test
