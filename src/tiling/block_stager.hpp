#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/tiling/point_store.hpp>

#include "tile_buffers.hpp"

namespace gdfmap {

/// A finished buffer as a block: digest, occupied cubes, sorted, encoded. Sorts `points` in place.
/// Pure, so that several may be made at the same time.
[[nodiscard]] NewBlock make_block(const TileKey& tile, std::vector<TileOffset>& points);

/// Turns a stream of lattice points into staged blocks of one source, in bounded memory. Not
/// thread-safe. @throws Error from add and finish: what the store throws, kInterrupted when
/// stopped.
class BlockStager {
 public:
  BlockStager(PointStore& store, std::int64_t source, std::size_t buffer_bytes,
              const RunContext& context);

  void add(const LatticePoint& p);
  /// Stages what is left.
  void finish();

  [[nodiscard]] std::uint64_t num_stored() const { return num_stored_; }
  [[nodiscard]] std::uint64_t num_duplicates() const { return num_duplicates_; }

 private:
  void stage(const std::vector<TileBuffers::Slot>& slots);
  void stage(TileBuffers::Slot slot);
  void append_pending();

  PointStore* store_;
  std::int64_t source_;
  const RunContext* context_;
  TileBuffers buffers_;
  std::vector<TileOffset> points_;  // of the buffer at hand
  std::vector<NewBlock> pending_;
  std::size_t pending_bytes_ = 0;
  std::uint64_t num_stored_ = 0;
  std::uint64_t num_duplicates_ = 0;
};

}  // namespace gdfmap
