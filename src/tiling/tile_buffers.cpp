#include "tile_buffers.hpp"

#include <algorithm>
#include <bit>

namespace gdfmap {
namespace {

constexpr std::size_t kMinBuckets = 4096;

/// Asks for a cache line ahead of its use, where the compiler knows how.
template <typename T>
void prefetch([[maybe_unused]] const T& value) {
#if defined(__GNUC__)
  __builtin_prefetch(&value);
#endif
}

}  // namespace

TileBuffers::TileBuffers(std::size_t max_bytes)
    : max_bytes_(std::min<std::size_t>(max_bytes, std::size_t{kNone} * kBytesPerTile)),
      // Chunks are never given back: some room must stay for tiles that come after a crowd.
      max_chunks_(max_bytes_ / 8 * 7 / sizeof(Chunk)),
      index_(kMinBuckets, kNone) {}

std::size_t TileBuffers::max_tiles() const {
  return (max_bytes_ - chunks_.size() * sizeof(Chunk)) / kBytesPerTile;
}

bool TileBuffers::has_room() const {
  const std::size_t bytes = chunks_.size() * sizeof(Chunk) + tiles_.size() * kBytesPerTile;
  if (num_free_chunks_ > 0) return bytes + kBytesPerTile <= max_bytes_;
  return chunks_.size() < max_chunks_ && bytes + kBytesPerTile + sizeof(Chunk) <= max_bytes_;
}

TileBuffers::Slot TileBuffers::add(const TileKey& key, TileOffset point) {
  if (last_ == kNone || tiles_[last_].key != key) last_ = find_or_add(key);
  Tile& tile = tiles_[last_];
  const std::size_t place = tile.num_points % kPointsPerChunk;
  if (place == 0) tile.first_chunk = new_chunk(tile.first_chunk);
  std::uint16_t(&xyz)[3] = chunks_[tile.first_chunk].xyz[place];
  xyz[0] = point.x;
  xyz[1] = point.y;
  xyz[2] = point.z;
  ++tile.num_points;
  return last_;
}

std::size_t TileBuffers::num_chunks(std::size_t num_points) {
  return (num_points + kPointsPerChunk - 1) / kPointsPerChunk;
}

std::uint32_t TileBuffers::new_chunk(std::uint32_t next) {
  std::uint32_t chunk = free_chunk_;
  if (chunk != kNone) {
    free_chunk_ = chunks_[chunk].next;
    --num_free_chunks_;
    if (free_chunk_ != kNone) prefetch(chunks_[free_chunk_]);
  } else {
    chunk = static_cast<std::uint32_t>(chunks_.size());
    chunks_.grow();
  }
  chunks_[chunk].next = next;
  return chunk;
}

std::size_t TileBuffers::bucket_of(const TileKey& key) const {
  std::size_t bucket = TileKeyHash{}(key) & (index_.size() - 1);
  while (index_[bucket] != kNone && tiles_[index_[bucket]].key != key) {
    bucket = (bucket + 1) & (index_.size() - 1);
  }
  return bucket;
}

TileBuffers::Slot TileBuffers::find_or_add(const TileKey& key) {
  Slot& slot = index_[bucket_of(key)];
  if (slot != kNone) return slot;
  const auto added = static_cast<Slot>(tiles_.size());
  slot = added;
  tiles_.grow();
  tiles_[added] = Tile{key};
  if (3 * tiles_.size() > 2 * index_.size()) rebuild_index(2 * index_.size());
  return added;
}

void TileBuffers::rebuild_index(std::size_t num_buckets) {
  index_.assign(num_buckets, kNone);
  for (std::size_t slot = 0; slot < tiles_.size(); ++slot) {
    index_[bucket_of(tiles_[slot].key)] = static_cast<Slot>(slot);
  }
}

void TileBuffers::take(std::span<const Slot> slots, std::vector<TileOffset>& points) {
  std::size_t begin = points.size();
  std::vector<Chain> chains;
  chains.reserve(slots.size());
  for (const Slot slot : slots) {
    const std::size_t count = tiles_[slot].num_points;
    if (count > 0) chains.push_back({&tiles_[slot], begin, (count - 1) % kPointsPerChunk + 1});
    begin += count;
  }
  points.resize(begin);
  // A chunk is most often not in the cache: while one chain waits for its next, others go on.
  constexpr std::size_t kSideBySide = 16;
  while (!chains.empty()) {
    const std::size_t first = chains.size() - std::min(chains.size(), kSideBySide);
    for (std::size_t i = chains.size(); i-- > first;) {
      if (take_chunk(chains[i], points)) continue;
      chains[i] = chains.back();
      chains.pop_back();
    }
  }
}

/// Moves the first chunk of a chain; false when it was the last.
bool TileBuffers::take_chunk(Chain& chain, std::vector<TileOffset>& points) {
  Tile& tile = *chain.tile;
  Chunk& chunk = chunks_[tile.first_chunk];
  for (std::size_t i = 0; i < chain.in_chunk; ++i) {
    points[chain.to++] = {chunk.xyz[i][0], chunk.xyz[i][1], chunk.xyz[i][2]};
  }
  chain.in_chunk = kPointsPerChunk;
  const std::uint32_t next = chunk.next;
  chunk.next = free_chunk_;
  free_chunk_ = tile.first_chunk;
  ++num_free_chunks_;
  tile.first_chunk = next;
  if (next != kNone) {
    prefetch(chunks_[next]);
    return true;
  }
  tile.num_points = 0;
  return false;
}

std::vector<TileBuffers::Slot> TileBuffers::occupied() const {
  std::vector<Slot> slots;
  slots.reserve(tiles_.size());
  for (std::size_t slot = 0; slot < tiles_.size(); ++slot) {
    if (tiles_[slot].num_points > 0) slots.push_back(static_cast<Slot>(slot));
  }
  return slots;
}

std::vector<TileBuffers::Slot> TileBuffers::all() const {
  std::vector<Slot> slots = occupied();
  sort_by_key(slots);
  return slots;
}

std::vector<TileBuffers::Slot> TileBuffers::largest() const {
  std::vector<Slot> slots = occupied();
  std::stable_sort(slots.begin(), slots.end(),
                   [&](Slot a, Slot b) { return num_points(a) > num_points(b); });
  std::size_t tiles_left = slots.size();
  std::size_t chunks_left = chunks_.size() - num_free_chunks_;
  std::size_t count = 0;
  while (count < slots.size() &&
         (tiles_left > max_tiles() / 2 || chunks_left > chunks_.size() / 2)) {
    --tiles_left;
    chunks_left -= num_chunks(num_points(slots[count++]));
  }
  slots.resize(count);
  sort_by_key(slots);
  return slots;
}

void TileBuffers::sort_by_key(std::vector<Slot>& slots) const {
  std::sort(slots.begin(), slots.end(), [&](Slot a, Slot b) { return tile(a) < tile(b); });
}

void TileBuffers::forget_empty() {
  std::size_t kept = 0;
  for (std::size_t slot = 0; slot < tiles_.size(); ++slot) {
    if (tiles_[slot].num_points > 0) tiles_[kept++] = tiles_[slot];
  }
  tiles_.shrink(kept);
  last_ = kNone;
  rebuild_index(std::max(kMinBuckets, std::bit_ceil(kept + kept / 2 + 1)));
}

}  // namespace gdfmap
