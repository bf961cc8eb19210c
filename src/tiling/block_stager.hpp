#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/tiling/point_store.hpp>

#include "tile_buffers.hpp"

namespace gdfmap {

/// A block on its way, and what became of the points that it was made from.
struct MadeBlock {
  NewBlock block;
  std::uint64_t num_duplicates = 0, num_thinned = 0;
};

/// A finished buffer as a block: digest, then sorted, thinned (0 voxel_steps: not) and encoded.
/// Changes `points` in place. Pure, so that several may be made at the same time.
[[nodiscard]] MadeBlock make_block(const TileKey& tile, std::vector<TileOffset>& points,
                                   int voxel_steps);

/// Turns a stream of lattice points into staged blocks of one source, in bounded memory. Not
/// thread-safe. @throws Error from add and finish: what the store throws, kInterrupted when
/// stopped.
class BlockStager {
 public:
  /// Thins as make_block() does.
  BlockStager(PointStore& store, std::int64_t source, int voxel_steps, std::size_t buffer_bytes,
              const RunContext& context);

  void add(const LatticePoint& p);
  /// Stages what is left.
  void finish();

  [[nodiscard]] std::uint64_t num_stored() const { return num_stored_; }
  [[nodiscard]] std::uint64_t num_duplicates() const { return num_duplicates_; }
  [[nodiscard]] std::uint64_t num_thinned() const { return num_thinned_; }

 private:
  void stage(const std::vector<TileBuffers::Slot>& slots);
  void stage(TileBuffers::Slot slot);
  void append_pending();

  PointStore* store_;
  std::int64_t source_;
  int voxel_steps_;
  const RunContext* context_;
  TileBuffers buffers_;
  std::vector<TileOffset> points_;  // of the buffer at hand
  std::vector<NewBlock> pending_;
  std::size_t pending_bytes_ = 0;
  std::uint64_t num_stored_ = 0;
  std::uint64_t num_duplicates_ = 0;
  std::uint64_t num_thinned_ = 0;
};

}  // namespace gdfmap
