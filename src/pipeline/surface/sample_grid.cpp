#include "sample_grid.hpp"

#include <cmath>

#include <gdfmap/core/lattice.hpp>

namespace gdfmap::surface {

std::int64_t SampleGrid::first_from(double from) const {
  // The quotient is rounded: the multiples themselves decide.
  auto index = static_cast<std::int64_t>(std::ceil(from / resolution_));
  while (position(index - 1) >= from) --index;
  while (position(index) < from) ++index;
  return index;
}

std::int64_t SampleGrid::cube_of(std::int64_t index) const {
  std::int64_t cube = floor_to_integer(position(index) / cube_size_);
  while (static_cast<double>(cube) * cube_size_ > position(index)) --cube;
  while (static_cast<double>(cube + 1) * cube_size_ <= position(index)) ++cube;
  return cube;
}

}  // namespace gdfmap::surface
