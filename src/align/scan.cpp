#include <map>
#include <mutex>

#include <gdfmap/align/scan.hpp>

namespace gdfmap {

struct Scan::Impl {
  Vector3 origin = Vector3::Zero();
  std::vector<Vector3> points;
  mutable std::mutex mutex;  ///< of what follows
  mutable std::map<double, SurfaceCloud> surfaces;
};

Scan::Scan(std::span<const Vector3> points) : impl_(std::make_unique<Impl>()) {
  impl_->points = voxel_means(points, 0.0);
  if (impl_->points.empty()) return;
  Vector3 sum = Vector3::Zero();
  const Vector3 first = impl_->points.front();
  for (const Vector3& p : impl_->points) sum += p - first;
  // Whole metres: subtracting them is exact for all but the smallest coordinates.
  impl_->origin = (first + sum / static_cast<double>(impl_->points.size())).array().round();
  for (Vector3& p : impl_->points) p -= impl_->origin;
}

Scan::Scan(Scan&&) noexcept = default;
Scan::~Scan() = default;

const Vector3& Scan::origin() const { return impl_->origin; }
const std::vector<Vector3>& Scan::points() const { return impl_->points; }

const SurfaceCloud& Scan::surface(double voxel, int num_threads) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->surfaces.try_emplace(voxel, impl_->points, voxel, num_threads).first->second;
}

}  // namespace gdfmap
