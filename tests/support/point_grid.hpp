#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <unordered_map>
#include <vector>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap::test {

/// Distances to the nearest of many points, exact up to a radius.
class PointGrid {
 public:
  PointGrid(std::span<const Vector3> points, double radius) : radius_(radius) {
    for (const Vector3& p : points) cells_[cell_of(p)].push_back(p);
  }

  /// Infinite beyond the radius.
  [[nodiscard]] double distance(const Vector3& p) const {
    const Cell own = cell_of(p);
    double least = radius_ * radius_;
    bool is_found = false;
    for (std::int64_t i = 0; i < 27; ++i) {
      const auto cell =
          cells_.find({own[0] + i % 3 - 1, own[1] + i / 3 % 3 - 1, own[2] + i / 9 - 1});
      if (cell == cells_.end()) continue;
      for (const Vector3& q : cell->second) {
        const double squared = (p - q).squaredNorm();
        if (squared > least) continue;
        least = squared;
        is_found = true;
      }
    }
    return is_found ? std::sqrt(least) : std::numeric_limits<double>::infinity();
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  [[nodiscard]] Cell cell_of(const Vector3& p) const {
    const auto along = [&](double v) { return static_cast<std::int64_t>(std::floor(v / radius_)); };
    return {along(p.x()), along(p.y()), along(p.z())};
  }

  struct Hash {
    std::size_t operator()(const Cell& cell) const {
      std::uint64_t hash = 0;
      for (const std::int64_t v : cell) {
        hash = (hash ^ static_cast<std::uint64_t>(v)) * 0x9E3779B97F4A7C15u;
      }
      return hash ^ hash >> 32;
    }
  };

  double radius_;
  std::unordered_map<Cell, std::vector<Vector3>, Hash> cells_;
};

}  // namespace gdfmap::test
