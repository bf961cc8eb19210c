#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "sample_grid.hpp"
#include "surface_domain.hpp"

namespace gdfmap::surface {

/// The unit of work: samples of one cube.
struct Block {
  SampleBox box;
  bool is_first_of_cube = false;
};

/// The blocks of a surface in order: tile by tile, cubes in Morton order, large cubes in several
/// blocks. Made as they are asked for.
class BlockQueue {
 public:
  /// @param tiles       in order; outlive it
  /// @param samples_of  those of a level-0 cube, may be none
  BlockQueue(std::span<const TileKey> tiles, std::function<SampleBox(const CubeKey&)> samples_of);

  /// The next blocks, at most `count`; none at the end.
  [[nodiscard]] std::vector<Block> take(std::size_t count);
  [[nodiscard]] std::size_t num_tiles_done() const { return next_tile_; }

 private:
  void add_tile(const TileKey& tile);

  std::span<const TileKey> tiles_;
  std::function<SampleBox(const CubeKey&)> samples_of_;
  std::size_t next_tile_ = 0;
  std::vector<SampleBox> cubes_;  ///< of the current tile
  std::size_t next_cube_ = 0;
  std::vector<Block> blocks_;  ///< of the current cube
  std::size_t next_block_ = 0;
};

}  // namespace gdfmap::surface
