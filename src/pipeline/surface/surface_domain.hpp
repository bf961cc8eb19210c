#pragma once

#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include <gdfmap/core/cube_mask.hpp>
#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/query/tile_source.hpp>

#include "sample_grid.hpp"

namespace gdfmap::surface {

/// Where a surface is looked for: the samples within `reach` (along each axis) of a level-0 cube
/// that holds points. Farther away none can be near a point, whatever the field says. Immutable and
/// thread-safe; holds the list of occupied tiles.
class SurfaceDomain {
 public:
  /// @param reach   metres, at most a cube's edge
  /// @param region  world frame, metres, half-open: only samples in it; empty: everywhere
  SurfaceDomain(TileSource& source, const SampleGrid& grid, double reach,
                const std::optional<Box3>& region);

  [[nodiscard]] const SampleGrid& grid() const { return grid_; }
  [[nodiscard]] const Lattice& lattice() const { return lattice_; }

  /// Every level-0 tile with a sample of the domain, in Morton order.
  [[nodiscard]] std::span<const TileKey> tiles() const { return tiles_; }

  [[nodiscard]] SampleBox all_samples_in(const CubeKey& cube) const;
  /// The samples of a level-0 cube that are in the domain: none, or a box that holds them all.
  [[nodiscard]] SampleBox samples_in(const CubeKey& cube) const;

 private:
  [[nodiscard]] bool is_occupied(const CubeKey& cube) const;
  /// Whether the region has samples in this tile.
  [[nodiscard]] bool has_samples(const TileKey& tile) const;
  [[nodiscard]] std::vector<TileKey> find_tiles() const;

  SampleGrid grid_;
  Lattice lattice_;
  double reach_;
  SampleBox region_;
  std::unordered_map<TileKey, CubeMask, TileKeyHash> occupied_;
  std::vector<TileKey> tiles_;
};

/// The 512 cubes of a tile in Morton order.
[[nodiscard]] const std::array<int, kCubesPerTile>& morton_order_of_cubes();

}  // namespace gdfmap::surface
