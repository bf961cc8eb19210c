#pragma once

#include <cstddef>
#include <cstdint>

#include <gdfmap/core/instruction_set.hpp>

namespace gdfmap {

/// Points in a leaf and boxes in a node.
inline constexpr int kTreeWidth = 16;

/// Coordinates of 16 points; unused places repeat the last point.
struct alignas(64) TreeLeaf {
  float xyz[3][kTreeWidth];
};
/// Boxes of 16 children; unused places hold a box infinitely far away.
struct alignas(64) TreeNode {
  float min[3][kTreeWidth], max[3][kTreeWidth];
};

/// A tree of boxes over leaves of points: node n of a level has the children 16 n … 16 n + 15 of
/// the level below, leaves below level 0. The last level has one node, the root. Owns nothing.
struct SearchTree {
  static constexpr int kMaxLevels = 8;
  const TreeLeaf* leaves = nullptr;
  const TreeNode* levels[kMaxLevels] = {};
  int num_levels = 0;
  float min[3] = {}, max[3] = {};  ///< box of all points
};

/// A packet of samples, in steps from the corner of the points' tile, and their squared distances
/// so far.
struct alignas(64) SearchPacket {
  static constexpr int kSize = 64;
  float xyz[3][kSize];
  float best[kSize];
  /// The leaf that held the last improvement: a good first guess for the samples that follow.
  std::uint32_t leaf = 0;
};

/// Exact search for one instruction set: lowers `best` to the squared distance to the nearest point
/// of the tree. A squared distance is fma(dz, dz, fma(dy, dy, dx²)) everywhere.
struct SearchKernels {
  /// All samples of a packet, a vector of them at a time: for samples that stand next to each
  /// other.
  void (*search_packet)(const SearchTree&, SearchPacket&);
  /// Sample `i` of a packet alone.
  void (*search_one)(const SearchTree&, SearchPacket&, int i);
};

/// The set must be supported.
[[nodiscard]] const SearchKernels& search_kernels(InstructionSet set);

namespace detail {
const SearchKernels& avx512_search_kernels();
const SearchKernels& avx2_search_kernels();
}  // namespace detail

}  // namespace gdfmap
