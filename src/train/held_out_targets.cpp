#include "held_out_targets.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "morton_grid.hpp"

namespace gdfmap {
namespace {

/// About as many as in chunks of training samples.
constexpr std::size_t kSamplesPerChunk = 1024;

/// The samples of a cube in the order of the search.
const std::vector<std::array<int, 3>>& places_in_cube(const TrainingGrid& grid) {
  static const auto populated = upright_grid(kPopulatedGrid.held_out);
  static const auto empty = upright_grid(kEmptyGrid.held_out);
  return grid == kPopulatedGrid ? populated : empty;
}

}  // namespace

HeldOutTargets::HeldOutTargets(const TrainingGrid& grid, int level, std::vector<int> cubes)
    : grid_(grid),
      level_(level),
      cubes_(std::move(cubes)),
      targets_(cubes_.size() * grid.num_held_out()) {}

std::size_t HeldOutTargets::cubes_per_chunk() const {
  return kSamplesPerChunk / grid_.num_held_out();
}

std::size_t HeldOutTargets::num_chunks() const {
  return (cubes_.size() + cubes_per_chunk() - 1) / cubes_per_chunk();
}

std::span<const int> HeldOutTargets::cubes_of(std::size_t chunk) const {
  const std::size_t begin = chunk * cubes_per_chunk();
  return std::span(cubes_).subspan(begin, std::min(cubes_per_chunk(), cubes_.size() - begin));
}

std::vector<Eigen::Vector3i> HeldOutTargets::samples(std::size_t chunk) const {
  const auto edge = static_cast<int>(steps_per_cube(level_));
  std::vector<Eigen::Vector3i> samples;
  samples.reserve(cubes_of(chunk).size() * grid_.num_held_out());
  for (const int cube : cubes_of(chunk)) {
    const std::array<int, 3> corner = cube_coordinates(cube);
    for (const auto& place : places_in_cube(grid_)) {
      const auto along = [&](std::size_t a) {
        return corner[a] * edge + static_cast<int>(grid_.held_out_offset(place[a], level_));
      };
      samples.emplace_back(along(0), along(1), along(2));
    }
  }
  return samples;
}

void HeldOutTargets::keep(std::size_t chunk, std::span<const float> distances) {
  const int n = grid_.held_out;
  auto next = distances.begin();
  float* of_cube = targets_.data() + chunk * cubes_per_chunk() * grid_.num_held_out();
  for (std::size_t i = 0; i < cubes_of(chunk).size(); ++i, of_cube += grid_.num_held_out()) {
    for (const auto& [x, y, z] : places_in_cube(grid_)) of_cube[(x * n + y) * n + z] = *next++;
  }
}

std::vector<float> HeldOutTargets::of_cube(int cube) const {
  const auto place = std::ranges::lower_bound(cubes_, cube) - cubes_.begin();
  const auto size = static_cast<std::ptrdiff_t>(grid_.num_held_out());
  const auto begin = targets_.begin() + place * size;
  return {begin, begin + size};
}

}  // namespace gdfmap
