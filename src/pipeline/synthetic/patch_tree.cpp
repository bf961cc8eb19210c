#include "patch_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace gdfmap::synthetic {
namespace {

constexpr std::size_t kMaxLeafPatches = 4;
/// Enough for any 32-bit count: halving bounds the depth.
constexpr std::size_t kMaxDepth = 64;

/// So much larger than the patch that rounding never prunes the nearest one.
Box3 padded_box(const Patch& patch) {
  const Box3 box = bounding_box(patch);
  const double largest = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  const Vector3 pad = Vector3::Constant(1e-9 * (1.0 + largest));
  return {box.min() - pad, box.max() + pad};
}

}  // namespace

PatchTree::PatchTree(std::vector<Patch> patches) : patches_(std::move(patches)) {
  nodes_.reserve(patches_.size());
  build(0, patches_.size());
}

std::uint32_t PatchTree::build(std::size_t begin, std::size_t end) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  Node node;
  Box3 centres;
  for (std::size_t i = begin; i < end; ++i) {
    const Box3 box = padded_box(patches_[i]);
    node.box.extend(box);
    centres.extend(box.center());
  }
  nodes_.push_back(node);
  if (end - begin <= kMaxLeafPatches) {
    nodes_[index].first = static_cast<std::uint32_t>(begin);
    nodes_[index].count = static_cast<std::uint32_t>(end - begin);
    return index;
  }
  Eigen::Index axis = 0;
  centres.sizes().maxCoeff(&axis);
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::size_t i) { return patches_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [axis](const Patch& p, const Patch& q) {
    return bounding_box(p).center()[axis] < bounding_box(q).center()[axis];
  });
  build(begin, middle);
  const std::uint32_t second = build(middle, end);
  nodes_[index].first = second;
  return index;
}

double PatchTree::distance(const Vector3& p_world) const {
  struct Entry {
    std::uint32_t node;
    double squared_bound;
  };
  std::array<Entry, kMaxDepth> stack;
  std::size_t depth = 0;
  double best = std::numeric_limits<double>::infinity();
  const auto entry = [&](std::uint32_t node) {
    return Entry{node, nodes_[node].box.squaredExteriorDistance(p_world)};
  };
  stack[depth++] = entry(0);
  while (depth > 0) {
    const Entry top = stack[--depth];
    if (top.squared_bound > best * best) continue;
    const Node& node = nodes_[top.node];
    for (std::uint32_t i = 0; i < node.count; ++i) {
      best = std::min(best, synthetic::distance(patches_[node.first + i], p_world));
    }
    if (node.count > 0) continue;
    Entry near = entry(top.node + 1), far = entry(node.first);
    if (far.squared_bound < near.squared_bound) std::swap(near, far);
    stack[depth++] = far;
    stack[depth++] = near;
  }
  return best;
}

}  // namespace gdfmap::synthetic
