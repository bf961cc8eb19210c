#include "locality_order.hpp"

#include <algorithm>

#include <gdfmap/core/morton.hpp>

namespace gdfmap {

std::vector<std::size_t> locality_order(std::span<const Vector3> points_world,
                                        const Lattice& lattice) {
  struct Entry {
    std::uint64_t code;
    std::size_t index;
  };
  std::vector<Entry> entries(points_world.size());
  for (std::size_t i = 0; i < points_world.size(); ++i) {
    std::uint64_t code = 0;
    // The code keeps the low 21 bits of a coordinate; tiles 2¹⁸ apart then mix, which only costs
    // time.
    if (const auto cube = lattice.cube_containing(points_world[i], 0)) {
      code = morton_code(static_cast<std::uint64_t>(cube->x), static_cast<std::uint64_t>(cube->y),
                         static_cast<std::uint64_t>(cube->z));
    }
    entries[i] = {code, i};
  }
  std::ranges::sort(entries, {}, &Entry::code);
  std::vector<std::size_t> order(entries.size());
  std::ranges::transform(entries, order.begin(), &Entry::index);
  return order;
}

}  // namespace gdfmap
