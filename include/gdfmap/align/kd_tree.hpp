#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap {

/// Nearest neighbours among points (nanoflann). Immutable; thread-safe. What is equally near is
/// told apart by the tree alone, so that answers depend on nothing but the points and their order.
class KdTree {
 public:
  /// @param points  metres, any frame, finite; must outlive the tree and stay where they are
  explicit KdTree(std::span<const Vector3> points);
  ~KdTree();
  KdTree(KdTree&&) noexcept;

  /// The point nearest to p if it is nearer than max_distance. Much quicker where `guess`, an index
  /// that may be right, is near.
  [[nodiscard]] std::optional<std::uint32_t> nearest(const Vector3& p, double max_distance,
                                                     std::optional<std::uint32_t> guess = {}) const;

  /// The k nearest, nearest first; fewer where there are fewer.
  void nearest(const Vector3& p, int k, std::vector<std::uint32_t>& indices) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace gdfmap
