#include "tile_samples.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include <gdfmap/core/error.hpp>

namespace gdfmap {

TileSamples::TileSamples(const TileKey& key, std::vector<int> cubes, const CubeMask& populated,
                         const Lattice& lattice)
    : key_(key),
      step_(lattice.step()),
      cubes_(std::move(cubes)),
      populated_(populated),
      classes_{make_class(false), make_class(true)} {}

TileSamples::Class TileSamples::make_class(bool populated) const {
  std::vector<int> of_class;
  std::ranges::copy_if(cubes_, std::back_inserter(of_class),
                       [&](int cube) { return populated_.test(cube) == populated; });
  const TrainingGrid& grid = training_grid(populated);
  GridTargets targets(grid, key_.level, of_class);
  return {std::move(targets), {grid, key_.level, std::move(of_class)}};
}

std::size_t TileSamples::num_chunks() const {
  std::size_t count = 0;
  for (const Class& c : classes_) count += c.targets.num_chunks() + c.held_out.num_chunks();
  return count;
}

template <typename Classes, typename Visit>
auto TileSamples::visit_chunk(Classes& classes, std::size_t chunk, const Visit& visit) {
  for (auto& c : classes) {
    if (chunk < c.targets.num_chunks()) return visit(c.targets, chunk);
    chunk -= c.targets.num_chunks();
    if (chunk < c.held_out.num_chunks()) return visit(c.held_out, chunk);
    chunk -= c.held_out.num_chunks();
  }
  throw Error(ErrorCode::kInternal, "samples of a chunk that a tile does not have");
}

std::vector<Eigen::Vector3i> TileSamples::samples(std::size_t chunk) const {
  return visit_chunk(classes_, chunk,
                     [](const auto& part, std::size_t i) { return part.samples(i); });
}

void TileSamples::keep(std::size_t chunk, std::span<const double> distances) {
  std::vector<float> metres(distances.size());
  std::ranges::transform(distances, metres.begin(),
                         [this](double d) { return static_cast<float>(d * step_); });
  visit_chunk(classes_, chunk, [&](auto& part, std::size_t i) { part.keep(i, metres); });
}

std::vector<float> TileSamples::targets(std::size_t n) const {
  return class_of(n).targets.of_cube(cubes_[n]);
}

std::vector<float> TileSamples::held_out(std::size_t n) const {
  return class_of(n).held_out.of_cube(cubes_[n]);
}

}  // namespace gdfmap
