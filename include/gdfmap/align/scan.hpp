#pragma once

#include <memory>
#include <span>
#include <vector>

#include <gdfmap/align/surface_cloud.hpp>

namespace gdfmap {

/// The source of a registration: a cloud whose pose is looked for. Its points are kept relative to
/// an origin among them, so that large coordinates lose nothing. Thread-safe; movable before it is
/// used by several threads.
class Scan {
 public:
  /// Points that are not finite are left out. @param points  metres, the scan's own frame
  explicit Scan(std::span<const Vector3> points);
  Scan(Scan&&) noexcept;
  ~Scan();

  [[nodiscard]] const Vector3& origin() const;               ///< in the scan's own frame
  [[nodiscard]] const std::vector<Vector3>& points() const;  ///< relative to origin()

  /// Made when it is first asked for; lives as long as the scan. @param num_threads  changes no bit
  [[nodiscard]] const SurfaceCloud& surface(double voxel, int num_threads) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gdfmap
