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
  /// Few are left, so that insertion is the cheapest way.
  static int nearest_first(const float (&bounds)[kTreeWidth], float limit,
                           int (&order)[kTreeWidth]) {
    unsigned within = 0;
    for (int i = 0; i < kTreeWidth; i += kW) {
      within |= bits(Lanes::load(bounds + i) < Lanes(limit)) << i;
    }
    int count = 0;
    for (; within != 0; within &= within - 1) {
      const int i = __builtin_ctz(within);
      int place = count++;
      for (; place > 0 && bounds[order[place - 1]] > bounds[i]; --place) {
        order[place] = order[place - 1];
      }
      order[place] = i;
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

  /// All samples of a packet on their way through the tree, a vector of them at a time: the samples
  /// of a vector stand close together, so that the box around them says much.
  struct PacketSearch {
    const SearchTree& tree;
    SearchPacket& packet;
    Query queries[kVectors];

    PacketSearch(const SearchTree& t, SearchPacket& p) : tree(t), packet(p) {
      for (int v = 0; v < kVectors; ++v) {
        for (int a = 0; a < 3; ++a) {
          const Lanes values = Lanes::load(packet.xyz[a] + v * kW);
          queries[v].min[a] = smallest(values);
          queries[v].max[a] = largest(values);
        }
        find_worst(v);
      }
    }

    void run() {
      if (!is_near()) return;
      for (int v = 0; v < kVectors; ++v) {
        improve(tree.leaves[packet.leaf], v);
        find_worst(v);
      }
      visit_node(tree.num_levels - 1, 0, (1u << kVectors) - 1);
    }

    /// Whether a sample may find something nearer in this tree: most know better from another one.
    bool is_near() const {
      for (const Query& query : queries) {
        Lanes distance[3];
        for (int a = 0; a < 3; ++a) {
          distance[a] = outside(Lanes(tree.min[a]), Lanes(tree.max[a]), Lanes(query.min[a]),
                                Lanes(query.max[a]));
        }
        const Lanes bound = squared_norm(distance[0], distance[1], distance[2]);
        if (bits(bound < Lanes(query.worst)) != 0) return true;
      }
      return false;
    }

    void find_worst(int v) { queries[v].worst = largest(Lanes::load(packet.best + v * kW)); }

    /// Compares all samples of a vector with all points of a leaf. Whether one found something
    /// nearer.
    bool improve(const TreeLeaf& leaf, int v) {
      const int offset = v * kW;
      const Lanes x = Lanes::load(packet.xyz[0] + offset), y = Lanes::load(packet.xyz[1] + offset),
                  z = Lanes::load(packet.xyz[2] + offset);
      const Lanes former = Lanes::load(packet.best + offset);
      Lanes best = former;
#pragma GCC unroll 4
      for (int i = 0; i < kTreeWidth; ++i) {
        best = min(best, squared_norm(Lanes(leaf.xyz[0][i]) - x, Lanes(leaf.xyz[1][i]) - y,
                                      Lanes(leaf.xyz[2][i]) - z));
      }
      best.store(packet.best + offset);
      return bits(best < former) != 0;
    }

    /// The same for some samples of the vector, one by one; bit i is lane i.
    bool improve_some(const TreeLeaf& leaf, int v, unsigned lanes) {
      bool has_improved = false;
      for (; lanes != 0; lanes &= lanes - 1) {
        const int i = v * kW + __builtin_ctz(lanes);
        const float nearest =
            nearest_in(leaf, packet.xyz[0][i], packet.xyz[1][i], packet.xyz[2][i]);
        if (!(nearest < packet.best[i])) continue;
        packet.best[i] = nearest;
        has_improved = true;
      }
      return has_improved;
    }

    /// The samples of a vector that may find something nearer in a box; bit i is lane i.
    unsigned lanes_near(const TreeNode& parent, int child, int v) const {
      Lanes distance[3];
      for (int a = 0; a < 3; ++a) {
        const Lanes p = Lanes::load(packet.xyz[a] + v * kW);
        distance[a] = outside(Lanes(parent.min[a][child]), Lanes(parent.max[a][child]), p, p);
      }
      const Lanes bound = squared_norm(distance[0], distance[1], distance[2]);
      return bits(bound < Lanes::load(packet.best + v * kW));
    }

    void visit_leaf(std::uint32_t index, const TreeNode& parent, int child, int v) {
      const unsigned lanes = lanes_near(parent, child, v);
      if (lanes == 0) return;
      const bool has_improved = __builtin_popcount(lanes) > kFewLanes
                                    ? improve(tree.leaves[index], v)
                                    : improve_some(tree.leaves[index], v, lanes);
      if (!has_improved) return;
      packet.leaf = index;
      find_worst(v);
    }

    /// @param vectors  those that may find something nearer in the node; bit v is vector v
    void visit_node(int level, std::uint32_t index, unsigned vectors) {
      const TreeNode& node = tree.levels[level][index];
      alignas(64) float bounds[kVectors][kTreeWidth];
      alignas(64) float least[kTreeWidth];
      for (float& bound : least) bound = kInfinity;
      for (unsigned rest = vectors; rest != 0; rest &= rest - 1) {
        const int v = __builtin_ctz(rest);
        bound_children(node, queries[v], bounds[v]);
        // Beyond the worst of the vector: not worth a visit.
        for (int i = 0; i < kTreeWidth; i += kW) {
          const Lanes bound = Lanes::load(bounds[v] + i);
          const Lanes kept = select(bound < Lanes(queries[v].worst), bound, Lanes(kInfinity));
          min(Lanes::load(least + i), kept).store(least + i);
        }
      }
      int order[kTreeWidth];
      const int count = nearest_first(least, kInfinity, order);
      for (int j = 0; j < count; ++j) {
        const int child = order[j];
        const std::uint32_t below = index * kTreeWidth + static_cast<std::uint32_t>(child);
        unsigned near = 0;
        for (unsigned rest = vectors; rest != 0; rest &= rest - 1) {
          const int v = __builtin_ctz(rest);
          if (!(bounds[v][child] < queries[v].worst)) continue;
          if (level == 0) {
            visit_leaf(below, node, child, v);
          } else if (lanes_near(node, child, v) != 0) {
            near |= 1u << v;
          }
        }
        if (near != 0) visit_node(level - 1, below, near);
      }
    }
  };

  static void search_packet(const SearchTree& tree, SearchPacket& packet) {
    PacketSearch(tree, packet).run();
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
