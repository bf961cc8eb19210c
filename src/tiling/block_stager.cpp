#include "block_stager.hpp"

#include <array>
#include <bit>

#include "voxel_thinning.hpp"

namespace gdfmap {
namespace {

/// Blocks of one transaction: large enough to make its cost small, small enough to end soon.
constexpr std::size_t kBytesPerTransaction = std::size_t{4} << 20;

/// The number whose bytes in memory are the little-endian ones of v.
std::int64_t little_endian(std::int64_t v) {
  if constexpr (std::endian::native == std::endian::little) return v;
  return detail::swap_bytes(v);
}

/// Sum of the hashes of the points' lattice coordinates: the same for any order and division.
Digest sum_of_hashes(const TileKey& tile, std::span<const TileOffset> points) {
  const LatticePoint origin = tile_origin(tile);
  Digest sum;
  for (const TileOffset& p : points) {
    const std::array<std::int64_t, 3> xyz{little_endian(origin.x + p.x),
                                          little_endian(origin.y + p.y),
                                          little_endian(origin.z + p.z)};
    sum += hash128(std::as_bytes(std::span(xyz)));
  }
  return sum;
}

TileOffset offset_in_tile(const LatticePoint& p, const TileKey& tile) {
  const LatticePoint origin = tile_origin(tile);
  return {static_cast<std::uint16_t>(p.x - origin.x), static_cast<std::uint16_t>(p.y - origin.y),
          static_cast<std::uint16_t>(p.z - origin.z)};
}

}  // namespace

MadeBlock make_block(const TileKey& tile, std::vector<TileOffset>& points, int voxel_steps) {
  MadeBlock made;
  NewBlock& block = made.block;
  block.tile = tile;
  block.digest = sum_of_hashes(tile, points);
  const std::size_t num_accepted = points.size();
  sort_unique(points);
  const std::size_t num_unique = points.size();
  thin(points, voxel_steps);
  made.num_duplicates = num_accepted - num_unique;
  made.num_thinned = num_unique - points.size();
  for (const TileOffset& p : points) block.cubes.set(p.cube());
  block.num_points = static_cast<std::uint32_t>(points.size());
  block.data = encode_block(points);
  return made;
}

BlockStager::BlockStager(PointStore& store, std::int64_t source, int voxel_steps,
                         std::size_t buffer_bytes, const RunContext& context)
    : store_(&store),
      source_(source),
      voxel_steps_(voxel_steps),
      context_(&context),
      buffers_(buffer_bytes) {}

void BlockStager::add(const LatticePoint& p) {
  if (!buffers_.has_room()) {
    stage(buffers_.largest());
    buffers_.forget_empty();
  }
  const TileKey tile = tile_of(p);
  const TileBuffers::Slot slot = buffers_.add(tile, offset_in_tile(p, tile));
  if (buffers_.num_points(slot) == kMaxBlockPoints) stage(slot);
}

void BlockStager::finish() {
  stage(buffers_.all());
  append_pending();
}

void BlockStager::stage(const std::vector<TileBuffers::Slot>& slots) {
  for (const TileBuffers::Slot slot : slots) stage(slot);
}

void BlockStager::stage(TileBuffers::Slot slot) {
  buffers_.take(slot, points_);
  MadeBlock made = make_block(buffers_.tile(slot), points_, voxel_steps_);
  num_stored_ += made.block.num_points;
  num_duplicates_ += made.num_duplicates;
  num_thinned_ += made.num_thinned;
  pending_.push_back(std::move(made.block));
  const NewBlock& block = pending_.back();
  pending_bytes_ += sizeof(NewBlock) + block.data.capacity();
  if (pending_bytes_ >= kBytesPerTransaction) append_pending();
}

void BlockStager::append_pending() {
  context_->throw_if_stopped();
  if (pending_.empty()) return;
  store_->append(source_, pending_);
  pending_.clear();
  pending_bytes_ = 0;
}

}  // namespace gdfmap
