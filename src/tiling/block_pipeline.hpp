#pragma once

#include <cstdint>
#include <exception>
#include <future>
#include <span>
#include <thread>
#include <vector>

#include <gdfmap/tiling/point_store.hpp>

#include "bounded_queue.hpp"

namespace gdfmap {

/// Full buffers on their way to become blocks: the points of one tile after those of another.
struct BufferBatch {
  struct Buffer {
    TileKey tile;
    std::uint32_t num_points = 0;
  };
  std::vector<Buffer> buffers;
  std::vector<TileOffset> points;
};

/// Blocks made from buffers, and what became of the points.
struct BlockBatch {
  std::vector<NewBlock> blocks;
  std::uint64_t num_stored = 0, num_duplicates = 0, num_thinned = 0;
};

/// Makes each buffer a block: digest, occupied cubes, sorted, thinned (0 voxel_steps: not),
/// encoded. Pure, so that several may be made at the same time.
[[nodiscard]] BlockBatch make_blocks(const BufferBatch& batch, int voxel_steps);

/// Makes blocks on several threads and appends them to a source on another one, in the order in
/// which the buffers were submitted, so that the bytes of the store do not depend on the threads.
/// Nothing else may use the store between the constructor and finish(). One thread submits.
class BlockPipeline {
 public:
  BlockPipeline(PointStore& store, std::int64_t source, int voxel_steps, int num_threads);
  /// Drops what is not appended yet.
  ~BlockPipeline();
  BlockPipeline(const BlockPipeline&) = delete;
  BlockPipeline& operator=(const BlockPipeline&) = delete;

  /// Waits while too much is on its way. @throws what an earlier batch threw.
  void submit(BufferBatch batch);
  /// Waits for everything. Once, after the last submit(). @throws what a batch threw.
  void finish();

  /// @name Valid after finish().
  /// @{
  [[nodiscard]] std::uint64_t num_stored() const { return num_stored_; }
  [[nodiscard]] std::uint64_t num_duplicates() const { return num_duplicates_; }
  [[nodiscard]] std::uint64_t num_thinned() const { return num_thinned_; }
  /// @}

 private:
  using Task = std::packaged_task<BlockBatch()>;

  void work();
  void write();
  void write_all();
  void abandon();
  void join();
  void rethrow();

  PointStore* store_;
  std::int64_t source_;
  int voxel_steps_;
  BoundedQueue<Task> tasks_;
  BoundedQueue<std::future<BlockBatch>> results_;  // in the order of submission
  std::uint64_t num_stored_ = 0, num_duplicates_ = 0, num_thinned_ = 0;
  std::exception_ptr error_;  // of the writer; read after it has ended
  std::vector<std::thread> threads_;
};

}  // namespace gdfmap
