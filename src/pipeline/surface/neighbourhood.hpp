#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <gdfmap/field/gaussians.hpp>
#include <gdfmap/query/tile_cache.hpp>

#include "aligned_floats.hpp"
#include "surface_kernels.hpp"

namespace gdfmap::surface {

/// The level-0 cubes in a box of keys that the field can be evaluated from, with their tiles kept
/// in memory. Tiles that cannot be read count as absent; the cache counts them.
class Neighbourhood {
 public:
  struct Cube {
    bool is_served = false;
    KernelView kernel;
    double mae = 0.0;  ///< metres, NaN where unknown
  };

  /// @param low, high  both included
  Neighbourhood(TileCache& cache, const CubeKey& low, const CubeKey& high);

  /// Null outside the box and where there is no cube with Gaussians.
  [[nodiscard]] const Cube* find(const CubeKey& key) const;

  /// The keys of the box are numbered in key order, from 0.
  [[nodiscard]] std::size_t num_places() const { return cubes_.size(); }
  [[nodiscard]] std::size_t place_of(const CubeKey& key) const;
  /// As find().
  [[nodiscard]] const Cube* at(std::size_t place) const {
    return cubes_[place].is_served ? &cubes_[place] : nullptr;
  }

  /// visit(key, cube) for each key of the box in key order; `cube` is null as in find().
  template <typename Visit>
  void for_each(const Visit& visit) const {
    CubeKey key = low_;
    for (key.x = low_.x; key.x <= high_.x; ++key.x) {
      for (key.y = low_.y; key.y <= high_.y; ++key.y) {
        for (key.z = low_.z; key.z <= high_.z; ++key.z) visit(key, find(key));
      }
    }
  }

 private:
  CubeKey low_, high_;
  std::vector<Cube> cubes_;
  std::vector<std::shared_ptr<const DecodedTile>> tiles_;
};

/// A cube's Gaussians as kernels want them. Used again for the next cube.
class GaussianRowsBuffer {
 public:
  /// Valid until the next call.
  [[nodiscard]] GaussianRows fill(const KernelView& cube);

 private:
  AlignedFloats floats_;
};

}  // namespace gdfmap::surface
