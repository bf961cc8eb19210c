#include "coarse_cubes.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace gdfmap {
namespace {

/// A box of whole level-0 cubes from the world's origin.
struct CubeBox {
  std::array<std::int64_t, 3> low, high;

  void extend(const CubeBox& other) {
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], other.low[a]);
      high[a] = std::max(high[a], other.high[a]);
    }
  }
  [[nodiscard]] std::int64_t squared_distance(const CubeBox& other) const {
    std::int64_t sum = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t gap =
          std::max({other.low[a] - high[a], low[a] - other.high[a], std::int64_t{0}});
      sum += gap * gap;
    }
    return sum;
  }
};

constexpr std::int64_t ceil_div(std::int64_t a, std::int64_t b) { return -floor_div(-a, b); }

/// The occupied cubes of a tile, one by one.
std::vector<CubeBox> occupied_boxes(const TilePoints& tile) {
  std::vector<CubeBox> boxes;
  for (int i = 0; i < kCubesPerTile; ++i) {
    if (!tile.cubes.test(i)) continue;
    const CubeKey c = cube_at(tile.key, i);
    boxes.push_back({{c.x, c.y, c.z}, {c.x + 1, c.y + 1, c.z + 1}});
  }
  return boxes;
}

/// Finds the cubes of one level near occupied ones.
class NearCubes {
 public:
  explicit NearCubes(int level) : level_(level), edge_(level_scale(level)), margin_(edge_ / 4) {
    static_assert(kMarginRatio == 0.25);
  }

  void add(const TilePoints& tile) {
    const std::vector<CubeBox> boxes = occupied_boxes(tile);
    if (boxes.empty()) return;
    CubeBox all = boxes.front();
    for (const CubeBox& box : boxes) {
      all.extend(box);
      mark(cube_holding(box), &CoarseCubes::populated);
    }
    const std::int64_t reach = kCoarseReach * edge_ + margin_;
    std::array<std::int64_t, 3> first, last;
    for (std::size_t a = 0; a < 3; ++a) {
      first[a] = ceil_div(all.low[a] - reach, edge_) - 1;
      last[a] = floor_div(all.high[a] + reach, edge_);
    }
    for (std::int64_t x = first[0]; x <= last[0]; ++x) {
      for (std::int64_t y = first[1]; y <= last[1]; ++y) {
        for (std::int64_t z = first[2]; z <= last[2]; ++z) {
          if (is_near({level_, x, y, z}, all, boxes)) mark({level_, x, y, z}, &CoarseCubes::wanted);
        }
      }
    }
  }

  [[nodiscard]] auto take() { return std::move(tiles_); }

 private:
  [[nodiscard]] CubeKey cube_holding(const CubeBox& box) const {
    return {level_, floor_div(box.low[0], edge_), floor_div(box.low[1], edge_),
            floor_div(box.low[2], edge_)};
  }
  void mark(const CubeKey& cube, CubeMask CoarseCubes::*mask) {
    (tiles_[tile_of(cube)].*mask).set(cube_index_in_tile(cube));
  }
  [[nodiscard]] bool is_wanted(const CubeKey& cube) const {
    const auto tile = tiles_.find(tile_of(cube));
    return tile != tiles_.end() && tile->second.wanted.test(cube_index_in_tile(cube));
  }
  [[nodiscard]] bool is_near(const CubeKey& cube, const CubeBox& all,
                             const std::vector<CubeBox>& boxes) const {
    CubeBox own;
    const std::array<std::int64_t, 3> key = {cube.x, cube.y, cube.z};
    for (std::size_t a = 0; a < 3; ++a) {
      own.low[a] = key[a] * edge_ - margin_;
      own.high[a] = (key[a] + 1) * edge_ + margin_;
    }
    const std::int64_t limit = kCoarseReach * edge_ * kCoarseReach * edge_;
    if (own.squared_distance(all) > limit || is_wanted(cube)) return false;  // nothing new
    return std::ranges::any_of(
        boxes, [&](const CubeBox& box) { return own.squared_distance(box) <= limit; });
  }

  int level_;
  std::int64_t edge_, margin_;  // in level-0 cubes
  std::unordered_map<TileKey, CoarseCubes, TileKeyHash> tiles_;
};

/// Whether the weights of the finer level sum to 1 in all of a cube and its margin: whether every
/// finer cube whose support, a quarter of its edge beyond its faces, reaches into it is served.
bool is_hidden(const CubeKey& cube, const TileMasks& finer_served) {
  static_assert(kLevelRatio == 4 && kMarginRatio == 0.25);
  constexpr int kFirst = -2, kLast = 5;
  for (int x = kFirst; x <= kLast; ++x) {
    for (int y = kFirst; y <= kLast; ++y) {
      for (int z = kFirst; z <= kLast; ++z) {
        const CubeKey finer{cube.level - 1, cube.x * kLevelRatio + x, cube.y * kLevelRatio + y,
                            cube.z * kLevelRatio + z};
        const auto tile = finer_served.find(tile_of(finer));
        if (tile == finer_served.end() || !tile->second.test(cube_index_in_tile(finer))) {
          return false;
        }
      }
    }
  }
  return true;
}

}  // namespace

std::unordered_map<TileKey, CoarseCubes, TileKeyHash> coarse_cubes(
    int level, std::span<const TilePoints> occupied, const TileMasks& finer_served) {
  NearCubes near(level);
  for (const TilePoints& tile : occupied) near.add(tile);
  auto tiles = near.take();
  for (auto& [key, cubes] : tiles) {
    CubeMask wanted;
    for (int i = 0; i < kCubesPerTile; ++i) {
      if (cubes.wanted.test(i) && !is_hidden(cube_at(key, i), finer_served)) wanted.set(i);
    }
    cubes.wanted = wanted;
  }
  std::erase_if(tiles, [](const auto& entry) { return !entry.second.wanted.any(); });
  return tiles;
}

}  // namespace gdfmap
