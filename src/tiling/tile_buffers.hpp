#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/tiling/block_codec.hpp>

namespace gdfmap {

/// An array that grows by slabs: no element moves, and growth needs no room for a second copy.
template <typename T>
class SlabArray {
 public:
  [[nodiscard]] std::size_t size() const { return size_; }
  T& operator[](std::size_t i) { return slabs_[i / kPerSlab][i % kPerSlab]; }
  const T& operator[](std::size_t i) const { return slabs_[i / kPerSlab][i % kPerSlab]; }
  /// Adds an element of indeterminate value.
  void grow() {
    if (size_ % kPerSlab == 0 && size_ / kPerSlab == slabs_.size()) {
      slabs_.push_back(std::make_unique_for_overwrite<T[]>(kPerSlab));
    }
    ++size_;
  }
  /// Keeps the slabs for later growth.
  void shrink(std::size_t size) { size_ = size; }

 private:
  static constexpr std::size_t kPerSlab = 8192;
  std::vector<std::unique_ptr<T[]>> slabs_;
  std::size_t size_ = 0;
};

/// Points on their way into blocks, collected by tile, in memory that stays below a given size
/// however many tiles the points touch. A tile's points are a chain of small chunks from one pool:
/// a tile with a single point costs about a hundred bytes, a crowded one a little over six bytes a
/// point. Not thread-safe.
class TileBuffers {
 public:
  /// Names a tile's buffer; valid until forget_empty().
  using Slot = std::uint32_t;

  explicit TileBuffers(std::size_t max_bytes);

  /// Whether any point can be added.
  [[nodiscard]] bool has_room() const;
  /// Adds a point to the buffer of its tile. Needs has_room() and a buffer of less than
  /// kMaxBlockPoints.
  Slot add(const TileKey& tile, TileOffset point);

  [[nodiscard]] const TileKey& tile(Slot slot) const { return tiles_[slot].key; }
  [[nodiscard]] std::size_t num_points(Slot slot) const { return tiles_[slot].num_points; }

  /// The fewest buffers, largest first, without which half of the room is free; in key order.
  [[nodiscard]] std::vector<Slot> largest() const;
  /// Every buffer that holds points, in key order.
  [[nodiscard]] std::vector<Slot> all() const;

  /// Appends the points of these buffers to `points`, one buffer after the other, those of each in
  /// an order that depends on the buffer alone; the buffers are empty then. No slot twice.
  void take(std::span<const Slot> slots, std::vector<TileOffset>& points);
  /// Makes room for other tiles where buffers are empty.
  void forget_empty();

 private:
  static constexpr std::uint32_t kNone = 0xffffffff;
  static constexpr std::size_t kPointsPerChunk = 10;  // with the link, one cache line

  // Without default values, so that a new slab stays untouched until it is used.
  struct Chunk {
    std::uint16_t xyz[kPointsPerChunk][3];
    std::uint32_t next;
  };
  struct Tile {
    TileKey key;
    std::uint32_t num_points = 0;
    std::uint32_t first_chunk = kNone;  // the only one that may be partly filled
  };

  /// What a tile costs beside its chunks: its record, at most three buckets of the index and as
  /// many again while the index grows, its place in the order of eviction and in the copy that
  /// sorts it.
  static constexpr std::size_t kBytesPerTile = sizeof(Tile) + 8 * sizeof(Slot);

  /// A buffer on its way out.
  struct Chain {
    Tile* tile;
    std::size_t to;        ///< where its next point goes
    std::size_t in_chunk;  ///< points in its first chunk
  };
  bool take_chunk(Chain& chain, std::vector<TileOffset>& points);

  /// Beside the chunks that there are.
  [[nodiscard]] std::size_t max_tiles() const;
  [[nodiscard]] static std::size_t num_chunks(std::size_t num_points);
  [[nodiscard]] Slot find_or_add(const TileKey& tile);
  [[nodiscard]] std::uint32_t new_chunk(std::uint32_t next);
  [[nodiscard]] std::size_t bucket_of(const TileKey& tile) const;
  void rebuild_index(std::size_t num_buckets);
  [[nodiscard]] std::vector<Slot> occupied() const;
  void sort_by_key(std::vector<Slot>& slots) const;

  std::size_t max_bytes_;
  std::size_t max_chunks_;
  SlabArray<Chunk> chunks_;
  std::uint32_t free_chunk_ = kNone;
  std::size_t num_free_chunks_ = 0;  // in the chain of free_chunk_
  SlabArray<Tile> tiles_;
  std::vector<Slot> index_;  // open addressing with linear probing, a power of two
  Slot last_ = kNone;        // neighbouring points most often share a tile
};

}  // namespace gdfmap
