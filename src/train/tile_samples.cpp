#include "tile_samples.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <utility>

#include "morton_grid.hpp"

namespace gdfmap {
namespace {

/// Cubes whose held-out samples are a chunk: about as many samples as in chunks of targets.
constexpr std::size_t kHeldOutCubesPerChunk = 4;

const std::vector<std::array<int, 3>>& held_out_places() {
  static const auto places = morton_ordered_grid(kHeldOutPerAxis);
  return places;
}

}  // namespace

TileSamples::TileSamples(const TileKey& key, std::vector<int> cubes, const CubeMask& populated,
                         const Lattice& lattice)
    : key_(key),
      step_(lattice.step()),
      cubes_(std::move(cubes)),
      populated_(populated),
      populated_targets_(make_targets(true)),
      empty_targets_(make_targets(false)),
      held_out_(cubes_.size() * kNumHeldOut) {}

GridTargets TileSamples::make_targets(bool populated) const {
  std::vector<int> of_class;
  std::ranges::copy_if(cubes_, std::back_inserter(of_class),
                       [&](int cube) { return populated_.test(cube) == populated; });
  return {training_grid(populated), key_.level, of_class};
}

std::size_t TileSamples::num_chunks() const {
  return populated_targets_.num_chunks() + empty_targets_.num_chunks() +
         (cubes_.size() + kHeldOutCubesPerChunk - 1) / kHeldOutCubesPerChunk;
}

std::vector<Eigen::Vector3i> TileSamples::samples(std::size_t chunk) const {
  for (const GridTargets* const targets : {&populated_targets_, &empty_targets_}) {
    if (chunk < targets->num_chunks()) return targets->samples(chunk);
    chunk -= targets->num_chunks();
  }
  return held_out_samples(chunk);
}

void TileSamples::keep(std::size_t chunk, std::span<const double> distances) {
  std::vector<float> metres(distances.size());
  std::ranges::transform(distances, metres.begin(),
                         [this](double d) { return static_cast<float>(d * step_); });
  for (GridTargets* const targets : {&populated_targets_, &empty_targets_}) {
    if (chunk < targets->num_chunks()) return targets->keep(chunk, metres);
    chunk -= targets->num_chunks();
  }
  keep_held_out(chunk, metres);
}

std::span<const int> TileSamples::held_out_cubes(std::size_t chunk) const {
  const std::size_t begin = chunk * kHeldOutCubesPerChunk;
  return std::span(cubes_).subspan(begin, std::min(kHeldOutCubesPerChunk, cubes_.size() - begin));
}

std::vector<Eigen::Vector3i> TileSamples::held_out_samples(std::size_t chunk) const {
  const auto edge = static_cast<int>(steps_per_cube(key_.level));
  std::array<int, kHeldOutPerAxis> offsets;
  for (int i = 0; i < kHeldOutPerAxis; ++i) {
    offsets[static_cast<std::size_t>(i)] = static_cast<int>(held_out_offset(i, key_.level));
  }
  std::vector<Eigen::Vector3i> samples;
  for (const int cube : held_out_cubes(chunk)) {
    const std::array<int, 3> corner = cube_coordinates(cube);
    for (const auto& place : held_out_places()) {
      const auto along = [&](std::size_t a) {
        return corner[a] * edge + offsets[static_cast<std::size_t>(place[a])];
      };
      samples.emplace_back(along(0), along(1), along(2));
    }
  }
  return samples;
}

void TileSamples::keep_held_out(std::size_t chunk, std::span<const float> distances) {
  auto next = distances.begin();
  float* held_out = held_out_.data() + chunk * kHeldOutCubesPerChunk * kNumHeldOut;
  for (std::size_t i = 0; i < held_out_cubes(chunk).size(); ++i, held_out += kNumHeldOut) {
    for (const auto& [x, y, z] : held_out_places()) {
      held_out[(x * kHeldOutPerAxis + y) * kHeldOutPerAxis + z] = *next++;
    }
  }
}

std::vector<float> TileSamples::targets(std::size_t n) const {
  return (is_populated(n) ? populated_targets_ : empty_targets_).of_cube(cubes_[n]);
}

void TileSamples::copy_held_out(std::size_t n, std::span<float, kNumHeldOut> held_out) const {
  std::copy_n(held_out_.begin() + static_cast<std::ptrdiff_t>(n * kNumHeldOut), kNumHeldOut,
              held_out.begin());
}

}  // namespace gdfmap
