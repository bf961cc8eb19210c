#pragma once

// The search, written once for any lane type (src/core/lanes.hpp). Included by one .cpp file per
// instruction set; everything has internal linkage and works on raw arrays.

#include "core/lanes.hpp"
#include "search_kernels.hpp"

namespace gdfmap {
namespace {

constexpr float kInfinity = __builtin_inff();

template <typename Lanes>
struct SearchArithmetic {
  static constexpr int kW = Lanes::kWidth;
  static constexpr int kVectors = SearchPacket::kSize / kW;
  /// So many samples of a vector are searched one by one, more all together.
  static constexpr int kFewLanes = 4;
  static_assert(kTreeWidth % kW == 0 && SearchPacket::kSize % kW == 0);

  static Lanes squared_norm(Lanes x, Lanes y, Lanes z) { return fma(z, z, fma(y, y, x * x)); }

  /// By how much a value lies outside of an interval, at least 0.
  static Lanes outside(Lanes low, Lanes high, Lanes value_low, Lanes value_high) {
    return max(max(low - value_high, value_low - high), Lanes(0.0f));
  }

  /// A box, of one sample or of many, with the largest squared distance of those in it.
  struct Query {
    float min[3], max[3];
    float worst;
  };

  /// Lower bounds of the squared distances from a query to the children of a node.
  static void bound_children(const TreeNode& node, const Query& query,
                             float (&bounds)[kTreeWidth]) {
    for (int i = 0; i < kTreeWidth; i += kW) {
      Lanes distance[3];
      for (int a = 0; a < 3; ++a) {
        distance[a] = outside(Lanes::load(node.min[a] + i), Lanes::load(node.max[a] + i),
                              Lanes(query.min[a]), Lanes(query.max[a]));
      }
      squared_norm(distance[0], distance[1], distance[2]).store(bounds + i);
    }
  }

  /// Children in the order of their bounds, those beyond the limit left out; returns their number.
  /// Each takes the place that counting the nearer ones gives: no branch depends on the bounds.
  static int nearest_first(const float (&bounds)[kTreeWidth], float limit,
                           int (&order)[kTreeWidth]) {
    unsigned within = 0;
    for (int i = 0; i < kTreeWidth; i += kW) {
      within |= bits(Lanes::load(bounds + i) < Lanes(limit)) << i;
    }
    const int count = __builtin_popcount(within);
    for (; within != 0; within &= within - 1) {
      const int i = __builtin_ctz(within);
      const Lanes own(bounds[i]);
      unsigned less = 0, not_greater = 0;
      for (int j = 0; j < kTreeWidth; j += kW) {
        const Lanes other = Lanes::load(bounds + j);
        less |= bits(other < own) << j;
        not_greater |= bits(other <= own) << j;
      }
      order[__builtin_popcount(less | (not_greater & ((1u << i) - 1)))] = i;
    }
    return count;
  }

  /// Smallest squared distance from a sample to the points of a leaf.
  static float nearest_in(const TreeLeaf& leaf, float x, float y, float z) {
    Lanes nearest(kInfinity);
    for (int i = 0; i < kTreeWidth; i += kW) {
      nearest = min(nearest, squared_norm(Lanes::load(leaf.xyz[0] + i) - Lanes(x),
                                          Lanes::load(leaf.xyz[1] + i) - Lanes(y),
                                          Lanes::load(leaf.xyz[2] + i) - Lanes(z)));
    }
    return smallest(nearest);
  }

  /// A vector of samples of a packet on its way through the tree: they stand close together, so
  /// that the box around them says much.
  struct VectorSearch {
    const SearchTree& tree;
    SearchPacket& packet;
    const int offset;  ///< of the vector in the packet
    Query query;
    std::uint32_t first_leaf;

    VectorSearch(const SearchTree& t, SearchPacket& p, int v)
        : tree(t), packet(p), offset(v * kW), first_leaf(p.leaf) {}

    void run() {
      // Most samples know better from another tree.
      if (lanes_near(tree.min, tree.max) == 0) return;
      for (int a = 0; a < 3; ++a) {
        query.min[a] = smallest(sample(a));
        query.max[a] = largest(sample(a));
      }
      query.worst = largest(best());
      const TreeNode& parent = tree.levels[0][first_leaf / kTreeWidth];
      visit_leaf(first_leaf, parent, static_cast<int>(first_leaf % kTreeWidth));
      visit_node(tree.num_levels - 1, 0);
    }

    Lanes sample(int axis) const { return Lanes::load(packet.xyz[axis] + offset); }
    Lanes best() const { return Lanes::load(packet.best + offset); }

    /// The samples that may find something nearer in a box; bit i is lane i.
    unsigned lanes_near(const float (&low)[3], const float (&high)[3]) const {
      Lanes distance[3];
      for (int a = 0; a < 3; ++a) {
        distance[a] = sample(a) - min(max(sample(a), Lanes(low[a])), Lanes(high[a]));
      }
      return bits(squared_norm(distance[0], distance[1], distance[2]) < best());
    }
    unsigned lanes_near(const TreeNode& parent, int child) const {
      const float low[3] = {parent.min[0][child], parent.min[1][child], parent.min[2][child]};
      const float high[3] = {parent.max[0][child], parent.max[1][child], parent.max[2][child]};
      return lanes_near(low, high);
    }

    /// Compares all samples with all points of a leaf. Whether one found something nearer.
    bool improve(const TreeLeaf& leaf) {
      const Lanes x = sample(0), y = sample(1), z = sample(2), former = best();
      Lanes nearest = former;
#pragma GCC unroll 4
      for (int i = 0; i < kTreeWidth; ++i) {
        nearest = min(nearest, squared_norm(Lanes(leaf.xyz[0][i]) - x, Lanes(leaf.xyz[1][i]) - y,
                                            Lanes(leaf.xyz[2][i]) - z));
      }
      nearest.store(packet.best + offset);
      return bits(nearest < former) != 0;
    }

    /// The same for some samples, one by one; bit i is lane i.
    bool improve_some(const TreeLeaf& leaf, unsigned lanes) {
      bool has_improved = false;
      for (; lanes != 0; lanes &= lanes - 1) {
        const int i = offset + __builtin_ctz(lanes);
        const float nearest =
            nearest_in(leaf, packet.xyz[0][i], packet.xyz[1][i], packet.xyz[2][i]);
        const float former = packet.best[i];
        const bool is_nearer = nearest < former;
        packet.best[i] = is_nearer ? nearest : former;
        has_improved |= is_nearer;
      }
      return has_improved;
    }

    void visit_leaf(std::uint32_t index, const TreeNode& parent, int child) {
      const unsigned lanes = lanes_near(parent, child);
      if (lanes == 0) return;
      const bool has_improved = __builtin_popcount(lanes) > kFewLanes
                                    ? improve(tree.leaves[index])
                                    : improve_some(tree.leaves[index], lanes);
      if (!has_improved) return;
      packet.leaf = index;
      query.worst = largest(best());
    }

    void visit_node(int level, std::uint32_t index) {
      const TreeNode& node = tree.levels[level][index];
      alignas(64) float bounds[kTreeWidth];
      bound_children(node, query, bounds);
      int order[kTreeWidth];
      const int count = nearest_first(bounds, query.worst, order);
      for (int j = 0; j < count && bounds[order[j]] < query.worst; ++j) {
        const int child = order[j];
        const std::uint32_t below = index * kTreeWidth + static_cast<std::uint32_t>(child);
        if (level == 0) {
          if (below != first_leaf) visit_leaf(below, node, child);
        } else if (lanes_near(node, child) != 0) {
          visit_node(level - 1, below);
        }
      }
    }
  };

  static void search_packet(const SearchTree& tree, SearchPacket& packet) {
    for (int v = 0; v < kVectors; ++v) VectorSearch(tree, packet, v).run();
  }

  struct SingleSearch {
    const SearchTree& tree;
    Query query;  // min = max = the sample
    std::uint32_t leaf;

    void visit_leaf(std::uint32_t index) {
      const float best = nearest_in(tree.leaves[index], query.min[0], query.min[1], query.min[2]);
      if (!(best < query.worst)) return;
      query.worst = best;
      leaf = index;
    }

    void visit_node(int level, std::uint32_t index) {
      alignas(64) float bounds[kTreeWidth];
      bound_children(tree.levels[level][index], query, bounds);
      int order[kTreeWidth];
      const int count = nearest_first(bounds, query.worst, order);
      for (int j = 0; j < count && bounds[order[j]] < query.worst; ++j) {
        const std::uint32_t below = index * kTreeWidth + static_cast<std::uint32_t>(order[j]);
        if (level == 0) {
          visit_leaf(below);
        } else {
          visit_node(level - 1, below);
        }
      }
    }
  };

  static void search_one(const SearchTree& tree, SearchPacket& packet, int i) {
    const float x = packet.xyz[0][i], y = packet.xyz[1][i], z = packet.xyz[2][i];
    SingleSearch search{tree, {{x, y, z}, {x, y, z}, packet.best[i]}, packet.leaf};
    search.visit_leaf(packet.leaf);
    search.visit_node(tree.num_levels - 1, 0);
    packet.best[i] = search.query.worst;
    packet.leaf = search.leaf;
  }

  static constexpr SearchKernels table() { return {search_packet, search_one}; }
};

}  // namespace
}  // namespace gdfmap
