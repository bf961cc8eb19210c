#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gdfmap::surface {

/// Corner c of a cell stands at (c & 1, c >> 1 & 1, c >> 2). An edge runs from a corner along an
/// axis to the next one.
struct CellEdge {
  int corner = 0;  ///< the lower one
  int axis = 0;
};
inline constexpr std::size_t kCellCorners = 8;
inline constexpr std::size_t kCellEdges = 12;
[[nodiscard]] const std::array<CellEdge, kCellEdges>& cell_edges();

/// The triangles of marching cubes (Lorensen and Cline, 1987) for a cell whose corners are inside
/// where their bit of `inside` is set: three edges each, counter-clockwise seen from outside. Made
/// from two rules instead of a table by hand, so that meshes are closed two-manifolds along their
/// edges: on a face with inside corners at the ends of one diagonal alone these are joined, which
/// both cells of the face decide alike; and no diagonal of a polygon lies in a face, where another
/// cell could have the same one.
[[nodiscard]] const std::vector<std::array<std::uint8_t, 3>>& cell_triangles(std::uint8_t inside);

}  // namespace gdfmap::surface
