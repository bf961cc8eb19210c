#include "block_pipeline.hpp"

#include <array>
#include <bit>
#include <utility>

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

}  // namespace

BlockBatch make_blocks(const BufferBatch& batch, int voxel_steps) {
  BlockBatch made;
  made.blocks.reserve(batch.buffers.size());
  std::vector<TileOffset> points;
  auto begin = batch.points.begin();
  for (const BufferBatch::Buffer& buffer : batch.buffers) {
    const auto end = begin + buffer.num_points;
    points.assign(begin, end);
    begin = end;
    NewBlock& block = made.blocks.emplace_back();
    block.tile = buffer.tile;
    block.digest = sum_of_hashes(buffer.tile, points);
    sort_unique(points);
    made.num_duplicates += buffer.num_points - points.size();
    const std::size_t num_unique = points.size();
    thin(points, voxel_steps);
    made.num_thinned += num_unique - points.size();
    made.num_stored += points.size();
    for (const TileOffset& p : points) block.cubes.set(p.cube());
    block.num_points = static_cast<std::uint32_t>(points.size());
    block.data = encode_block(points);
  }
  return made;
}

BlockPipeline::BlockPipeline(PointStore& store, std::int64_t source, int voxel_steps,
                             int num_threads)
    : store_(&store),
      source_(source),
      voxel_steps_(voxel_steps),
      tasks_(static_cast<std::size_t>(num_threads)),
      results_(2 * static_cast<std::size_t>(num_threads)) {
  try {
    for (int i = 0; i < num_threads; ++i) threads_.emplace_back(&BlockPipeline::work, this);
    threads_.emplace_back(&BlockPipeline::write, this);
  } catch (...) {  // the system refused a thread
    abandon();
    throw;
  }
}

BlockPipeline::~BlockPipeline() { abandon(); }

void BlockPipeline::abandon() {
  tasks_.abandon();
  results_.abandon();
  join();
}

void BlockPipeline::submit(BufferBatch batch) {
  Task task([this, batch = std::move(batch)] { return make_blocks(batch, voxel_steps_); });
  auto result = task.get_future();
  if (!tasks_.push(std::move(task)) || !results_.push(std::move(result))) rethrow();
}

void BlockPipeline::finish() {
  tasks_.close();
  results_.close();
  rethrow();
}

void BlockPipeline::rethrow() {
  join();
  if (error_) std::rethrow_exception(error_);
}

void BlockPipeline::join() {
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

void BlockPipeline::work() {
  while (auto task = tasks_.pop()) (*task)();  // an exception goes into its future
}

void BlockPipeline::write() {
  try {
    write_all();
  } catch (...) {
    error_ = std::current_exception();
    tasks_.abandon();
    results_.abandon();
  }
}

void BlockPipeline::write_all() {
  std::vector<NewBlock> waiting;
  std::size_t waiting_bytes = 0;
  const auto append = [&] {
    if (!waiting.empty()) store_->append(source_, waiting);
    waiting.clear();
    waiting_bytes = 0;
  };
  while (auto result = results_.pop()) {
    BlockBatch batch = result->get();
    num_stored_ += batch.num_stored;
    num_duplicates_ += batch.num_duplicates;
    num_thinned_ += batch.num_thinned;
    for (NewBlock& block : batch.blocks) {
      waiting_bytes += sizeof(NewBlock) + block.data.capacity();
      waiting.push_back(std::move(block));
    }
    if (waiting_bytes >= kBytesPerTransaction) append();
  }
  append();
}

}  // namespace gdfmap
