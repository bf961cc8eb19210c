#include "block_mesher.hpp"

#include <algorithm>
#include <cmath>

#include "cell_triangles.hpp"

namespace gdfmap::surface {
namespace {

/// Keeps the vertices of edges that meet in a sample apart.
constexpr double kNearestToSample = 0.02;

SampleIndex corner_of(SampleIndex cell, int corner) {
  for (std::size_t axis = 0; axis < 3; ++axis) cell[axis] += corner >> axis & 1;
  return cell;
}

}  // namespace

std::size_t LatticeEdgeHash::operator()(const LatticeEdge& edge) const noexcept {
  constexpr std::uint64_t kOdd = 0x9E3779B97F4A7C15u;  // 2⁶⁴ over the golden ratio
  auto hash = static_cast<std::uint64_t>(edge.axis);
  for (const std::int64_t i : edge.sample) {
    hash = (hash ^ static_cast<std::uint64_t>(i)) * kOdd;
    hash ^= hash >> 32;
  }
  return hash;
}

BlockMesh BlockMesher::mesh(const Block& block) {
  block_ = block.box;
  SampleBox samples = block.box;
  for (std::int64_t& end : samples.end) ++end;
  BlockMesh mesh;
  mesh.num_samples = sampler_.sample(samples);
  mesh.is_cube = block.is_first_of_cube && mesh.num_samples > 0;
  mesh.is_poor_cube = block.is_first_of_cube && !sampler_.poor_cubes().empty();
  if (mesh.num_samples == 0) return mesh;
  indices_.assign(3 * samples.count(), 0);
  mark_inside();
  for (std::int64_t z = 0; z < static_cast<std::int64_t>(block_.size(2)); ++z) {
    for (std::int64_t y = 0; y < static_cast<std::int64_t>(block_.size(1)); ++y) {
      add_row(y, z, mesh);
    }
  }
  place_vertices(mesh);
  return mesh;
}

void BlockMesher::mark_inside() {
  const SampleBox& samples = sampler_.box();
  inside_.clear();
  for (std::size_t z = 0; z < samples.size(2); ++z) {
    for (std::size_t y = 0; y < samples.size(1); ++y) {
      for (const float v : std::span(sampler_.row(y, z), samples.size(0))) {
        inside_.push_back(std::abs(v) < threshold_ ? 1 : 0);
      }
    }
  }
}

/// The cells between four rows of samples along x.
void BlockMesher::add_row(std::int64_t y, std::int64_t z, BlockMesh& mesh) {
  const std::size_t row = block_.size(0) + 1, plane = row * (block_.size(1) + 1);
  const std::uint8_t* const first =
      inside_.data() + static_cast<std::size_t>(z) * plane + static_cast<std::size_t>(y) * row;
  // Bits 0, 2, 4 and 6 are the corners with an even x, the others those with an odd one.
  const auto corners_at = [&](std::size_t x) {
    return static_cast<unsigned>(first[x] | first[x + row] << 2 | first[x + plane] << 4 |
                                 first[x + plane + row] << 6);
  };
  unsigned low = corners_at(0);
  for (std::size_t x = 0; x < block_.size(0); ++x) {
    const unsigned high = corners_at(x + 1);
    const auto inside = static_cast<std::uint8_t>(low | high << 1);
    low = high;
    if (inside != 0 && inside != 255) add_cell({static_cast<std::int64_t>(x), y, z}, inside, mesh);
  }
}

float BlockMesher::value(const SampleIndex& local) const {
  const auto at = [&](std::size_t axis) { return static_cast<std::size_t>(local[axis]); };
  return std::abs(sampler_.row(at(1), at(2))[at(0)]);
}

void BlockMesher::add_cell(const SampleIndex& local, std::uint8_t inside, BlockMesh& mesh) {
  for (const auto& edges : cell_triangles(inside)) {
    std::array<std::uint32_t, 3> triangle;
    for (std::size_t i = 0; i < 3; ++i) {
      const CellEdge& edge = cell_edges()[edges[i]];
      triangle[i] = vertex_on(corner_of(local, edge.corner), edge.axis, mesh);
    }
    mesh.triangles.push_back(triangle);
  }
}

std::uint32_t BlockMesher::vertex_on(const SampleIndex& local, int axis, BlockMesh& mesh) {
  const auto at = [&](std::size_t a) { return static_cast<std::size_t>(local[a]); };
  const std::size_t sample = (at(2) * (block_.size(1) + 1) + at(1)) * (block_.size(0) + 1) + at(0);
  std::uint32_t& index = indices_[3 * sample + static_cast<std::size_t>(axis)];
  if (index == 0) {
    MeshVertex vertex;
    vertex.edge.axis = axis;
    for (std::size_t a = 0; a < 3; ++a) {
      vertex.edge.sample[a] = block_.begin[a] + local[a];
      // The cells around an edge on the face of a block are those of two.
      const bool is_on_face = at(a) == 0 || at(a) == block_.size(a);
      if (a != static_cast<std::size_t>(axis) && is_on_face) vertex.num_blocks *= 2;
    }
    vertex.point.position = crossing(local, axis);
    mesh.vertices.push_back(vertex);
    index = static_cast<std::uint32_t>(mesh.vertices.size());
  }
  return index - 1;
}

/// Where the field passes the threshold on an edge, world frame, metres.
Vector3 BlockMesher::crossing(const SampleIndex& local, int axis) const {
  SampleIndex next = local;
  ++next[static_cast<std::size_t>(axis)];
  const double low = static_cast<double>(value(local)), high = static_cast<double>(value(next));
  // An end outside the domain tells nothing: then it is the middle.
  const double share = std::isfinite(low) && std::isfinite(high)
                           ? (static_cast<double>(threshold_) - low) / (high - low)
                           : 0.5;
  Vector3 p;
  for (std::size_t a = 0; a < 3; ++a) {
    p[static_cast<int>(a)] = grid_.position(block_.begin[a] + local[a]);
  }
  p[axis] += grid_.resolution() * std::clamp(share, kNearestToSample, 1.0 - kNearestToSample);
  return p;
}

/// Completes the vertices, in batches.
void BlockMesher::place_vertices(BlockMesh& mesh) {
  std::vector<Vector3> positions;
  for (std::size_t first = 0; first < mesh.vertices.size(); first += Projector::kBatch) {
    const auto batch =
        std::span(mesh.vertices)
            .subspan(first, std::min(Projector::kBatch, mesh.vertices.size() - first));
    positions.clear();
    for (const MeshVertex& vertex : batch) positions.push_back(vertex.point.position);
    const auto placed = is_shell_ ? projector_.describe(positions) : projector_.project(positions);
    for (std::size_t i = 0; i < batch.size(); ++i) batch[i].point = placed[i];
  }
}

}  // namespace gdfmap::surface
