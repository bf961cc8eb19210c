#include "tile_samples.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <utility>

#include "morton_grid.hpp"

namespace gdfmap {

TileSamples::TileSamples(const TileKey& key, std::vector<int> cubes, const CubeMask& populated,
                         const Lattice& lattice, ExactDistance& exact_distance)
    : key_(key),
      step_(lattice.step()),
      exact_distance_(&exact_distance),
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

std::vector<float> TileSamples::distances(std::span<const Eigen::Vector3i> samples) const {
  const std::vector<double> steps =
      exact_distance_->nearest(tile_origin(key_), samples, SampleOrder::kPackets);
  std::vector<float> metres(steps.size());
  std::transform(steps.begin(), steps.end(), metres.begin(),
                 [this](double d) { return static_cast<float>(d * step_); });
  return metres;
}

std::size_t TileSamples::num_chunks() const {
  return populated_targets_.num_chunks() + empty_targets_.num_chunks() + cubes_.size();
}

void TileSamples::look_up(std::size_t chunk) {
  const GridTargets::Distances distances_at = [this](std::span<const Eigen::Vector3i> samples) {
    return distances(samples);
  };
  for (GridTargets* const targets : {&populated_targets_, &empty_targets_}) {
    if (chunk < targets->num_chunks()) {
      targets->look_up(chunk, distances_at);
      return;
    }
    chunk -= targets->num_chunks();
  }
  look_up_held_out(chunk);
}

void TileSamples::look_up_held_out(std::size_t cube) {
  static const auto places = morton_ordered_grid(kHeldOutPerAxis);
  const auto edge = static_cast<int>(steps_per_cube(key_.level));
  const std::array<int, 3> corner = cube_coordinates(cubes_[cube]);
  std::vector<Eigen::Vector3i> samples;
  for (const auto& place : places) {
    Eigen::Vector3i sample;
    for (std::size_t a = 0; a < 3; ++a) {
      sample[static_cast<Eigen::Index>(a)] =
          corner[a] * edge + static_cast<int>(held_out_offset(place[a], key_.level));
    }
    samples.push_back(sample);
  }
  const std::vector<float> found = distances(samples);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& [x, y, z] = places[i];
    held_out_[cube * kNumHeldOut +
              static_cast<std::size_t>((x * kHeldOutPerAxis + y) * kHeldOutPerAxis + z)] = found[i];
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
