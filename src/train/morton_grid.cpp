#include "morton_grid.hpp"

#include <algorithm>
#include <utility>

#include <gdfmap/core/morton.hpp>

namespace gdfmap {
namespace {

std::uint64_t code(const std::array<int, 3>& p) {
  return morton_code(static_cast<std::uint64_t>(p[0]), static_cast<std::uint64_t>(p[1]),
                     static_cast<std::uint64_t>(p[2]));
}

}  // namespace

std::vector<std::array<int, 3>> morton_ordered_grid(int side) {
  std::vector<std::array<int, 3>> places;
  for (int i = 0; i < side * side * side; ++i) {
    places.push_back({i / (side * side), i / side % side, i % side});
  }
  std::ranges::sort(places, {}, code);
  return places;
}

std::vector<std::array<int, 3>> upright_grid(int side) {
  std::vector<std::array<int, 3>> places = morton_ordered_grid(side);
  for (auto& [x, y, z] : places) std::swap(x, z);
  return places;
}

std::array<int, 3> cube_coordinates(int index) {
  constexpr int n = kCubesPerTileAxis;
  return {index % n, index / n % n, index / (n * n)};
}

std::uint64_t morton_code_of_cube(int index) { return code(cube_coordinates(index)); }

}  // namespace gdfmap
