#pragma once

// For programs that use PCL: gdfmap itself neither needs nor links it. Include this header where
// pcl::PointCloud is at hand.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <pcl/point_cloud.h>

#include <gdfmap/io/point_reader.hpp>

namespace gdfmap {

/// The positions of a cloud in its own frame, for DistanceField::at(). `Point` has x, y and z.
template <typename Point>
[[nodiscard]] std::vector<Vector3> positions(const pcl::PointCloud<Point>& cloud) {
  std::vector<Vector3> points;
  points.reserve(cloud.size());
  for (const Point& point : cloud) points.emplace_back(point.x, point.y, point.z);
  return points;
}

/// Reads a cloud in memory as if it were a file, for ingest_points(). The cloud is not copied: it
/// must outlive the reader and stay as it is. Its sensor pose is not applied. Its identity is that
/// of its coordinates, so that the same points again are recognised.
template <typename Point>
class PclPointReader final : public PointReader {
 public:
  explicit PclPointReader(const pcl::PointCloud<Point>& cloud) : cloud_(cloud) {
    info_.format = "PCL point cloud";
    info_.num_points = cloud.size();
  }

  [[nodiscard]] const CloudInfo& info() const override { return info_; }

  [[nodiscard]] std::size_t read(std::span<Vector3> points) override {
    const std::size_t count = std::min(points.size(), cloud_.size() - next_);
    for (std::size_t i = 0; i < count; ++i) {
      const Point& point = cloud_[next_ + i];
      points[i] = Vector3(point.x, point.y, point.z);
    }
    next_ += count;
    return count;
  }

  [[nodiscard]] Digest identity() override {
    next_ = cloud_.size();
    StreamHasher hasher;
    for (const Point& point : cloud_) {
      const float coordinates[3] = {point.x, point.y, point.z};
      hasher.update(std::as_bytes(std::span(coordinates)));
    }
    return hasher.digest();
  }

  [[nodiscard]] std::uint64_t num_bytes() const override {
    return cloud_.size() * 3 * sizeof(float);
  }

 private:
  const pcl::PointCloud<Point>& cloud_;
  CloudInfo info_;
  std::size_t next_ = 0;
};

}  // namespace gdfmap
