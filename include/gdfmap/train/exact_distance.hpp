#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/edt/nearest_point_index.hpp>
#include <gdfmap/tiling/point_store.hpp>

namespace gdfmap {

/// Samples that stand near each other: the nearer, the fewer units are looked at.
struct SampleGroup {
  LatticePoint origin;                       ///< what samples are relative to
  std::span<const Eigen::Vector3i> samples;  ///< quantisation steps, within ±2²³ of the origin
  SampleOrder order = SampleOrder::kPackets;
};

/// Exact distances to the nearest published point of a store, out of core: points are indexed in
/// units of at most a quarter million (a tile, or an octant of an over-full one), of which a
/// byte-bounded number is kept, and a unit is visited only for samples that may lie nearer to its
/// box than to any point seen so far. Thread-safe, while nobody else uses the store.
class ExactDistance {
 public:
  /// @param tiles        every tile of the store that counts, in key order; outlives this object
  /// @param index_bytes  for the indices kept; those in use are kept in any case
  ExactDistance(PointStore& store, std::span<const TilePoints> tiles, std::size_t index_bytes);
  ~ExactDistance();

  /// @param origin   what samples are relative to
  /// @param samples  quantisation steps, within ±2²³ of the origin; the nearer they stand to each
  ///                 other, the fewer units are looked at
  /// @returns for each sample the distance in steps; infinity when the store has no points
  [[nodiscard]] std::vector<double> nearest(const LatticePoint& origin,
                                            std::span<const Eigen::Vector3i> samples,
                                            SampleOrder order);

  /// The same for many groups, unit by unit instead of group by group: each unit is indexed once or
  /// twice, however few can be kept. Where all can be kept, one group after the other takes less
  /// time.
  [[nodiscard]] std::vector<std::vector<double>> nearest(std::span<const SampleGroup> groups,
                                                         int num_threads);

  /// Whether the units in and next to these tiles of any level can be kept together.
  [[nodiscard]] bool can_keep(std::span<const TileKey> keys) const;

  /// Indexes what samples in these tiles will ask for, on several threads, as far as the bytes
  /// allow.
  void prefetch(std::span<const TileKey> keys, int num_threads);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gdfmap
