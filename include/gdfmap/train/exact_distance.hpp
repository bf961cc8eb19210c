#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/tiling/point_store.hpp>

namespace gdfmap {

/// Exact distances to the nearest published point of a store, out of core: points are indexed in
/// units of at most a million (a tile, or an octant of an over-full one), of which a byte-bounded
/// number is kept, and a unit is visited only for samples that may lie nearer to its box than to
/// any point seen so far. Not thread-safe; a call runs on several threads.
class ExactDistance {
 public:
  /// @param tiles        every tile of the store that counts, in key order; outlives this object
  /// @param index_bytes  for the indices kept; one is always kept
  ExactDistance(PointStore& store, std::span<const TilePoints> tiles, std::size_t index_bytes);
  ~ExactDistance();

  /// @param origin       what samples are relative to
  /// @param samples      quantisation steps, within ±2²³ of the origin; neighbours stand near each
  /// other
  /// @param num_threads  threads of this call
  /// @returns for each sample the distance in steps; infinity when the store has no points
  [[nodiscard]] std::vector<double> nearest(const LatticePoint& origin,
                                            std::span<const Eigen::Vector3i> samples,
                                            int num_threads);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gdfmap
