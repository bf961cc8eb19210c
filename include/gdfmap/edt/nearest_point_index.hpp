#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace gdfmap {

/// Exact squared distances to the nearest of up to a few million points.
///
/// Coordinates are whole quantisation steps from the minimum corner of the points' level-0 tile,
/// held in float32: points in [0, 65536), samples within ±2²⁴ of the corner. Differences are then
/// exact, so that a squared distance depends on the pair alone, whatever the order of traversal,
/// and the box bounds, rounded by the same monotone operations, never exceed it: pruning needs no
/// slack.
///
/// Points are Morton-sorted into leaves of 16, under a tree of 16-wide boxes. Immutable after
/// construction; thread-safe.
class NearestPointIndex {
 public:
  explicit NearestPointIndex(std::vector<Eigen::Vector3f> points);

  [[nodiscard]] std::size_t num_points() const { return num_points_; }
  [[nodiscard]] const Eigen::AlignedBox3f& bounds() const { return bounds_; }
  [[nodiscard]] std::size_t memory_bytes() const;

  /// best_squared[i] = min(best_squared[i], squared distance from samples[i] to the nearest point),
  /// in steps². Neighbouring samples should stand next to each other.
  void update(std::span<const Eigen::Vector3f> samples, std::span<float> best_squared) const;

 private:
  static constexpr std::size_t kWidth = 16;
  /// Coordinates of 16 points; unused places repeat the last point.
  struct Leaf {
    alignas(64) float x[kWidth], y[kWidth], z[kWidth];
  };
  /// Boxes of 16 children; unused places hold a box infinitely far away.
  struct Node {
    alignas(64) float min[3][kWidth], max[3][kWidth];
  };
  /// One sample on its way down the tree.
  struct Search {
    Eigen::Vector3f p;
    float best;
    std::size_t best_leaf;
  };

  void build_leaves(std::span<const Eigen::Vector3f> sorted);
  void build_tree();
  void visit_leaf(std::size_t leaf, Search& search) const;
  void visit_node(std::size_t level, std::size_t node, Search& search) const;

  std::size_t num_points_ = 0;
  Eigen::AlignedBox3f bounds_;
  std::vector<Leaf> leaves_;
  std::vector<std::vector<Node>>
      levels_;  ///< levels_[0] above the leaves, the last one is the root
};

}  // namespace gdfmap
