#include "cell_triangles.hpp"

#include <algorithm>
#include <utility>

namespace gdfmap::surface {
namespace {

using Triangle = std::array<std::uint8_t, 3>;
using Polygon = std::vector<std::uint8_t>;  ///< edges of a cell
constexpr std::uint8_t kNone = 255;

/// Corners of the faces, counter-clockwise seen from outside.
constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                              {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

std::uint8_t edge_between(int a, int b) {
  const auto& edges = cell_edges();
  for (std::uint8_t e = 0; e < kCellEdges; ++e) {
    if (edges[e].corner == std::min(a, b) && (a ^ b) == 1 << edges[e].axis) return e;
  }
  return kNone;
}

bool lies_on(std::uint8_t edge, const int (&face)[4]) {
  for (int i = 0; i < 4; ++i) {
    if (edge_between(face[i], face[(i + 1) % 4]) == edge) return true;
  }
  return false;
}

bool share_a_face(std::uint8_t a, std::uint8_t b) {
  return std::ranges::any_of(
      kFaces, [&](const auto& face) { return lies_on(a, face) && lies_on(b, face); });
}

/// The edge that follows each crossed edge in the polygons of a cell: around every face, from where
/// one comes back inside to where one left.
std::array<std::uint8_t, kCellEdges> successors(unsigned inside) {
  std::array<std::uint8_t, kCellEdges> next;
  next.fill(kNone);
  const auto is_inside = [&](int corner) { return (inside >> corner & 1) != 0; };
  for (const auto& face : kFaces) {
    for (int i = 0; i < 4; ++i) {
      if (!is_inside(face[i]) || is_inside(face[(i + 1) % 4])) continue;
      int j = (i + 1) % 4;
      while (!is_inside(face[(j + 1) % 4])) j = (j + 1) % 4;
      next[edge_between(face[j], face[(j + 1) % 4])] = edge_between(face[i], face[(i + 1) % 4]);
    }
  }
  return next;
}

/// Divides a polygon into triangles without a diagonal in a face; false where there is none.
bool divide(const Polygon& polygon, std::vector<Triangle>& triangles) {
  const std::size_t n = polygon.size();
  if (n == 3) {
    triangles.push_back({polygon[0], polygon[1], polygon[2]});
    return true;
  }
  for (std::size_t i = 0; i < n; ++i) {  // cut off the corner behind i
    const std::uint8_t a = polygon[i], b = polygon[(i + 1) % n], c = polygon[(i + 2) % n];
    if (share_a_face(a, c)) continue;
    Polygon rest = polygon;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>((i + 1) % n));
    const std::size_t size = triangles.size();
    triangles.push_back({a, b, c});
    if (divide(rest, triangles)) return true;
    triangles.resize(size);
  }
  return false;
}

std::vector<Triangle> triangles_of(unsigned inside) {
  std::array<std::uint8_t, kCellEdges> next = successors(inside);
  std::vector<Triangle> triangles;
  for (std::uint8_t first = 0; first < kCellEdges; ++first) {
    Polygon polygon;
    for (std::uint8_t e = first; next[e] != kNone;) {
      polygon.push_back(e);
      e = std::exchange(next[e], kNone);
    }
    if (!polygon.empty()) divide(polygon, triangles);
  }
  return triangles;
}

}  // namespace

const std::array<CellEdge, kCellEdges>& cell_edges() {
  static const auto edges = [] {
    std::array<CellEdge, kCellEdges> list;
    std::size_t count = 0;
    for (int axis = 0; axis < 3; ++axis) {
      for (int corner = 0; corner < static_cast<int>(kCellCorners); ++corner) {
        if ((corner >> axis & 1) == 0) list[count++] = {corner, axis};
      }
    }
    return list;
  }();
  return edges;
}

const std::vector<Triangle>& cell_triangles(std::uint8_t inside) {
  static const auto table = [] {
    std::array<std::vector<Triangle>, 256> cases;
    for (unsigned i = 0; i < cases.size(); ++i) cases[i] = triangles_of(i);
    return cases;
  }();
  return table[inside];
}

}  // namespace gdfmap::surface
