#include "block_stager.hpp"

#include <utility>

namespace gdfmap {
namespace {

/// What makes a batch worth a hand-over to another thread.
constexpr std::size_t kPointsPerBatch = kMaxBlockPoints;
constexpr std::size_t kBuffersPerBatch = 4096;

/// A tile begins at a multiple of its 65536 steps, so that the low 16 bits are the offset.
TileOffset offset_in_tile(const LatticePoint& p) {
  static_assert(kStepsPerTileAxis == 1 << 16);
  return {static_cast<std::uint16_t>(p.x & 0xffff), static_cast<std::uint16_t>(p.y & 0xffff),
          static_cast<std::uint16_t>(p.z & 0xffff)};
}

}  // namespace

void BlockStager::add(const LatticePoint& p) {
  if (!buffers_.has_room()) {
    stage(buffers_.largest());
    buffers_.forget_empty();
  }
  const TileBuffers::Slot slot = buffers_.add(tile_of(p), offset_in_tile(p));
  if (buffers_.num_points(slot) == kMaxBlockPoints) stage(std::span(&slot, 1));
}

void BlockStager::finish() { stage(buffers_.all()); }

void BlockStager::stage(std::span<const TileBuffers::Slot> slots) {
  while (!slots.empty()) {
    BufferBatch batch;
    std::size_t num_points = 0;
    for (const TileBuffers::Slot slot : slots) {
      if (num_points >= kPointsPerBatch || batch.buffers.size() >= kBuffersPerBatch) break;
      const auto count = static_cast<std::uint32_t>(buffers_.num_points(slot));
      batch.buffers.push_back({buffers_.tile(slot), count});
      num_points += count;
    }
    batch.points.reserve(num_points);
    buffers_.take(slots.first(batch.buffers.size()), batch.points);
    slots = slots.subspan(batch.buffers.size());
    pipeline_->submit(std::move(batch));
  }
}

}  // namespace gdfmap
