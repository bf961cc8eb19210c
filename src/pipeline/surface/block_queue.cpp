#include "block_queue.hpp"

#include <algorithm>
#include <utility>

#include "block_sampler.hpp"

namespace gdfmap::surface {
namespace {

/// The samples of one axis in parts of about one length, none longer than a block may be.
std::vector<std::pair<std::int64_t, std::int64_t>> parts_of(std::int64_t begin, std::int64_t end) {
  const std::int64_t count = (end - begin + BlockSampler::kMaxSide - 1) / BlockSampler::kMaxSide;
  std::vector<std::pair<std::int64_t, std::int64_t>> parts;
  for (std::int64_t i = 0; i < count; ++i) {
    parts.emplace_back(begin + (end - begin) * i / count, begin + (end - begin) * (i + 1) / count);
  }
  return parts;
}

std::vector<Block> blocks_of(const SampleBox& cube) {
  std::vector<Block> blocks;
  for (const auto& [z0, z1] : parts_of(cube.begin[2], cube.end[2])) {
    for (const auto& [y0, y1] : parts_of(cube.begin[1], cube.end[1])) {
      for (const auto& [x0, x1] : parts_of(cube.begin[0], cube.end[0])) {
        blocks.push_back({{{x0, y0, z0}, {x1, y1, z1}}, blocks.empty()});
      }
    }
  }
  return blocks;
}

}  // namespace

BlockQueue::BlockQueue(std::span<const TileKey> tiles,
                       std::function<SampleBox(const CubeKey&)> samples_of)
    : tiles_(tiles), samples_of_(std::move(samples_of)) {}

std::vector<Block> BlockQueue::take(std::size_t count) {
  std::vector<Block> taken;
  while (taken.size() < count) {
    if (next_block_ < blocks_.size()) {
      taken.push_back(blocks_[next_block_++]);
    } else if (next_cube_ < cubes_.size()) {
      blocks_ = blocks_of(cubes_[next_cube_++]);
      next_block_ = 0;
    } else if (next_tile_ < tiles_.size()) {
      add_tile(tiles_[next_tile_++]);
    } else {
      break;
    }
  }
  return taken;
}

void BlockQueue::add_tile(const TileKey& tile) {
  cubes_.clear();
  next_cube_ = 0;
  for (const int index : morton_order_of_cubes()) {
    const SampleBox samples = samples_of_(cube_at(tile, index));
    if (samples.count() > 0) cubes_.push_back(samples);
  }
}

}  // namespace gdfmap::surface
