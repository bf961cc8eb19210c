#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include <gdfmap/core/morton.hpp>
#include <gdfmap/query/occupancy_index.hpp>

namespace gdfmap {
namespace {

constexpr std::size_t kGroup = 8;

bool morton_order(const TileKey& a, const TileKey& b) {
  const std::int64_t left[3] = {a.x, a.y, a.z}, right[3] = {b.x, b.y, b.z};
  return morton_less(left, right);
}

/// From the interval to p, zero inside.
double gap(double p, double low, double high) {
  if (p < low) return p - low;
  return p > high ? p - high : 0.0;
}

/// Sums in one order everywhere, so that no rounding makes a box nearer than a cube in it.
double squared(double x, double y, double z) { return z * z + y * y + x * x; }

}  // namespace

/// One search, from the root down, nearest boxes first.
class OccupancyIndex::Search {
 public:
  Search(const OccupancyIndex& index, const Vector3& p) : index_(index), p_(p) {}

  void visit_node(std::size_t layer, std::size_t node) {
    if (layer == 0) {
      visit_group(
          node, index_.tiles_.size(),
          [&](std::size_t tile) { return bound(bounds_of(index_.tiles_[tile].key)); },
          [&](std::size_t tile) { visit_tile(index_.tiles_[tile]); });
    } else {
      const std::vector<Bounds>& children = index_.layers_[layer - 1];
      visit_group(
          node, children.size(), [&](std::size_t child) { return bound(children[child]); },
          [&](std::size_t child) { visit_node(layer - 1, child); });
    }
  }

  [[nodiscard]] FarBound result() const {
    const double distance = std::sqrt(best_);
    if (distance == 0.0) return {};
    return {distance, nearest_ / distance};
  }

  static Bounds bounds_of(const TileKey& key) {
    return {{key.x, key.y, key.z}, {key.x, key.y, key.z}};
  }

 private:
  double tile_gap(int axis, std::int32_t low, std::int32_t high) const {
    const double edge = index_.cube_size_ * kCubesPerTileAxis;
    return gap(p_[axis], low * edge, (high + 1.0) * edge);
  }
  double bound(const Bounds& b) const {
    return squared(tile_gap(0, b.low[0], b.high[0]), tile_gap(1, b.low[1], b.high[1]),
                   tile_gap(2, b.low[2], b.high[2]));
  }
  /// To the interval of cube `offset` of a tile along an axis.
  double cube_gap(int axis, std::int32_t tile, int offset) const {
    const double cube = static_cast<double>(tile) * kCubesPerTileAxis + offset;
    return gap(p_[axis], cube * index_.cube_size_, (cube + 1.0) * index_.cube_size_);
  }

  template <typename BoundOf, typename Visit>
  void visit_group(std::size_t node, std::size_t num_children, const BoundOf& bound_of,
                   const Visit& visit) {
    struct Candidate {
      double bound;
      std::size_t child;
    };
    std::array<Candidate, kGroup> candidates;  // sorted, nearest first
    std::size_t count = 0;
    const std::size_t first = node * kGroup;
    for (std::size_t child = first; child < std::min(first + kGroup, num_children); ++child) {
      const double lower_bound = bound_of(child);
      if (lower_bound >= best_) continue;
      std::size_t at = count++;
      for (; at > 0 && lower_bound < candidates[at - 1].bound; --at) {
        candidates[at] = candidates[at - 1];
      }
      candidates[at] = {lower_bound, child};
    }
    for (std::size_t i = 0; i < count && candidates[i].bound < best_; ++i) {
      visit(candidates[i].child);
    }
  }

  /// A word of the mask is a layer of cubes, a byte of it a row along x.
  void visit_tile(const OccupiedTile& tile) {
    for (int z = 0; z < kCubesPerTileAxis; ++z) {
      const std::uint64_t layer = tile.cubes.words()[static_cast<std::size_t>(z)];
      const double gap_z = cube_gap(2, tile.key.z, z);
      if (layer == 0 || squared(0.0, 0.0, gap_z) >= best_) continue;
      for (int y = 0; y < kCubesPerTileAxis; ++y) {
        const auto row = static_cast<std::uint8_t>(layer >> (8 * y));
        const double gap_y = cube_gap(1, tile.key.y, y);
        if (row == 0 || squared(0.0, gap_y, gap_z) >= best_) continue;
        visit_row(row, tile.key.x, gap_y, gap_z);
      }
    }
  }

  void visit_row(std::uint8_t row, std::int32_t tile_x, double gap_y, double gap_z) {
    for (unsigned bits = row; bits != 0; bits &= bits - 1) {
      const double gap_x = cube_gap(0, tile_x, std::countr_zero(bits));
      const double distance = squared(gap_x, gap_y, gap_z);
      if (distance >= best_) continue;
      best_ = distance;
      nearest_ = {gap_x, gap_y, gap_z};
    }
  }

  const OccupancyIndex& index_;
  Vector3 p_;
  double best_ = std::numeric_limits<double>::infinity();
  Vector3 nearest_ = Vector3::Zero();
};

OccupancyIndex::OccupancyIndex(std::vector<OccupiedTile> tiles, double cube_size)
    : tiles_(std::move(tiles)), cube_size_(cube_size) {
  std::erase_if(tiles_, [](const OccupiedTile& tile) { return !tile.cubes.any(); });
  std::ranges::sort(tiles_, morton_order, &OccupiedTile::key);
  if (tiles_.empty()) return;
  std::vector<Bounds> boxes;
  boxes.reserve(tiles_.size());
  for (const OccupiedTile& tile : tiles_) boxes.push_back(Search::bounds_of(tile.key));
  do {
    std::vector<Bounds> layer((boxes.size() + kGroup - 1) / kGroup);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      Bounds& node = layer[i / kGroup];
      if (i % kGroup == 0) node = boxes[i];
      for (int axis = 0; axis < 3; ++axis) {
        node.low[axis] = std::min(node.low[axis], boxes[i].low[axis]);
        node.high[axis] = std::max(node.high[axis], boxes[i].high[axis]);
      }
    }
    layers_.push_back(layer);
    boxes = std::move(layer);
  } while (boxes.size() > 1);
}

const CubeMask* OccupancyIndex::find(const TileKey& tile) const {
  const auto at = std::ranges::lower_bound(tiles_, tile, morton_order, &OccupiedTile::key);
  return at != tiles_.end() && at->key == tile ? &at->cubes : nullptr;
}

std::optional<FarBound> OccupancyIndex::nearest(const Vector3& p_world) const {
  if (empty()) return std::nullopt;
  Search search(*this, p_world);
  search.visit_node(layers_.size() - 1, 0);
  return search.result();
}

}  // namespace gdfmap
