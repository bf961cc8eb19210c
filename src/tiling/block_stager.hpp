#pragma once

#include <cstddef>
#include <span>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/tiling/point_store.hpp>

#include "block_pipeline.hpp"
#include "tile_buffers.hpp"

namespace gdfmap {

/// Turns a stream of lattice points into blocks of one source, in bounded memory: points are
/// collected by tile, and buffers that are full, or the largest when there is no more room, go to a
/// pipeline. What becomes a block depends on the points and buffer_bytes alone. Not thread-safe.
class BlockStager {
 public:
  BlockStager(BlockPipeline& pipeline, std::size_t buffer_bytes)
      : pipeline_(&pipeline), buffers_(buffer_bytes) {}

  /// @throws what the pipeline throws
  void add(const LatticePoint& p);
  /// Submits what is left. @throws what the pipeline throws
  void finish();

 private:
  void stage(std::span<const TileBuffers::Slot> slots);

  BlockPipeline* pipeline_;
  TileBuffers buffers_;
};

}  // namespace gdfmap
