#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <gdfmap/core/lattice.hpp>

namespace gdfmap {

/// Places (x, y, z) of a grid of side³ in Morton order, so that any run of them stands close
/// together.
[[nodiscard]] std::vector<std::array<int, 3>> morton_ordered_grid(int side);

/// The same with z turned over fastest: runs of 16 stand upright, so that little of the ground, of
/// floors and roofs is below and above them.
[[nodiscard]] std::vector<std::array<int, 3>> upright_grid(int side);

/// Place of the cube with this index in its tile, and the place's Morton code.
[[nodiscard]] std::array<int, 3> cube_coordinates(int index);
[[nodiscard]] std::uint64_t morton_code_of_cube(int index);

}  // namespace gdfmap
