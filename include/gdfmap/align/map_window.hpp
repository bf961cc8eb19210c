#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include <gdfmap/align/ndt_cells.hpp>
#include <gdfmap/align/surface_cloud.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/map/map.hpp>
#include <gdfmap/query/distance_field.hpp>

namespace gdfmap {

/// The target of a registration: a read-only view of a cloud, or of what lies around a scan in a
/// map of any size. It gives the same points as surfaces, as NDT cells and as a distance field,
/// each made when it is first asked for. All but the field is in coordinates relative to a local
/// origin near the points, so that doubles lose nothing wherever the map lies.
///
/// Voxels lie on the world's lattice and their sums are exact integers: a window does not depend on
/// the order of the points. Thread-safe; movable before it is used by several threads.
class MapWindow {
 public:
  /// All points of a cloud, rounded to a lattice of 1/8192 m; those that are not finite or beyond
  /// the lattice are left out. Holds six bytes a point.
  explicit MapWindow(std::span<const Vector3> points_world);

  struct MapOptions {
    double reach = 5.0;                              ///< around the scan, metres
    std::size_t max_bytes = std::size_t{512} << 20;  ///< of what is made of the points
    std::shared_ptr<const DistanceField> field;      ///< of the map; may be null
  };
  /// The tiles of a map within reach of a scan, laid on it by a first guess. Tiles are read from
  /// the store each time that something is made of them. Those farthest from the scan's centre are
  /// left out when their surfaces would take more than max_bytes.
  /// @param map         outlives the window; nobody else may use its connections meanwhile
  /// @param scan_world  points of the scan where they are thought to be
  MapWindow(Map& map, std::span<const Vector3> scan_world, const MapOptions& options);

  MapWindow(MapWindow&&) noexcept;
  ~MapWindow();

  [[nodiscard]] const Vector3& origin_world() const;
  [[nodiscard]] std::uint64_t num_points() const;  ///< in the window
  [[nodiscard]] std::size_t num_tiles() const;
  [[nodiscard]] std::size_t num_tiles_left_out() const;

  /// The mean of the points of every voxel, with normals. @param voxel  edge, metres, rounded to
  /// the lattice. @param num_threads  changes no bit. Lives as long as the window.
  [[nodiscard]] const SurfaceCloud& surface(double voxel, int num_threads) const;
  [[nodiscard]] const NdtCells& cells(double edge) const;
  /// Null where there is none.
  [[nodiscard]] const DistanceField* field() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gdfmap
