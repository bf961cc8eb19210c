#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include <gdfmap/core/geometry.hpp>

#include "block_queue.hpp"
#include "projector.hpp"

namespace gdfmap::surface {

/// An edge of the lattice, from a sample along an axis to the next one: the name of the vertex on
/// it, whichever block finds it.
struct LatticeEdge {
  SampleIndex sample{};
  int axis = 0;
  bool operator==(const LatticeEdge&) const = default;
};

struct LatticeEdgeHash {
  [[nodiscard]] std::size_t operator()(const LatticeEdge& edge) const noexcept;
};

struct MeshVertex {
  LatticeEdge edge;
  int num_blocks = 1;  ///< that have this vertex
  ProjectedPoint point;
};

/// The part of a mesh in one block's cells.
struct BlockMesh {
  std::vector<MeshVertex> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< of these vertices, normals outwards
  std::uint64_t num_samples = 0;
  bool is_cube = false, is_poor_cube = false;  ///< of the first block of a cube alone
};

/// Finds the mesh around the samples whose absolute value is below a threshold, by marching cubes.
/// What is outside the domain counts as farther away, so that the mesh is closed. Not thread-safe;
/// used again for other blocks.
class BlockMesher {
 public:
  /// @param threshold  metres
  /// @param is_shell   leave vertices at the threshold, instead of moving them onto the surface
  BlockMesher(const FieldOnGrid& field, double threshold, bool is_shell)
      : grid_(field.domain.grid()),
        threshold_(static_cast<float>(threshold)),
        is_shell_(is_shell),
        sampler_(field),
        projector_(field) {}

  /// Of the cells whose lower corner is in the block.
  [[nodiscard]] BlockMesh mesh(const Block& block);

 private:
  void mark_inside();
  void add_row(std::int64_t y, std::int64_t z, BlockMesh& mesh);
  void add_cell(const SampleIndex& local, std::uint8_t inside, BlockMesh& mesh);
  [[nodiscard]] std::uint32_t vertex_on(const SampleIndex& local, int axis, BlockMesh& mesh);
  [[nodiscard]] Vector3 crossing(const SampleIndex& local, int axis) const;
  [[nodiscard]] float value(const SampleIndex& local) const;
  void place_vertices(BlockMesh& mesh);

  const SampleGrid& grid_;
  float threshold_;
  bool is_shell_;
  BlockSampler sampler_;
  Projector projector_;
  std::vector<std::uint8_t> inside_;  ///< of each sample, [z][y][x]: 1 below the threshold
  SampleBox block_;                   ///< of lower corners; the samples are one more an axis
  std::vector<std::uint32_t>
      indices_;  ///< of the vertex on each edge of the block, 0: none, else +1
};

}  // namespace gdfmap::surface
