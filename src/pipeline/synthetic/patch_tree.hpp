#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "patch.hpp"

namespace gdfmap::synthetic {

/// A binary tree of boxes over patches, for the distance to the nearest of many: the same value as
/// the minimum over all, bit for bit. Immutable and thread-safe.
class PatchTree {
 public:
  /// @param patches  at least one
  explicit PatchTree(std::vector<Patch> patches);

  [[nodiscard]] double distance(const Vector3& p_world) const;

 private:
  struct Node {
    Box3 box;
    std::uint32_t first = 0;  ///< leaf: first patch; else the second child (the first one follows)
    std::uint32_t count = 0;  ///< of patches; 0: not a leaf
  };

  std::uint32_t build(std::size_t begin, std::size_t end);

  std::vector<Patch> patches_;  ///< those of a leaf lie together
  std::vector<Node> nodes_;
};

}  // namespace gdfmap::synthetic
