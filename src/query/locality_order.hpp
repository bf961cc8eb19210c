#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/lattice.hpp>

namespace gdfmap {

/// The order in which to answer a batch: points of one tile together, and within it those of one
/// cube, so that each tile is fetched once or twice however large the batch. The result does not
/// depend on it.
[[nodiscard]] std::vector<std::size_t> locality_order(std::span<const Vector3> points_world,
                                                      const Lattice& lattice);

}  // namespace gdfmap
