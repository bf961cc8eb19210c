#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/lattice.hpp>

namespace gdfmap {

/// Most points that are ordered at a time.
inline constexpr std::size_t kMaxOrdered = std::size_t{1} << 20;

/// The indices of at most kMaxOrdered points, neighbours in space near each other: in Morton order
/// of their level-0 cubes, so that the points of a cube, and of a tile, come in a row. Points
/// beyond the lattice come anywhere. The order changes no answer, only the time that they take.
[[nodiscard]] std::vector<std::uint32_t> locality_order(std::span<const Vector3> points_world,
                                                        const Lattice& lattice);

}  // namespace gdfmap
