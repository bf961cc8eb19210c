#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include <gdfmap/align/surface_cloud.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/core/morton.hpp>
#include <gdfmap/core/parallel.hpp>

namespace gdfmap {
namespace {

constexpr std::size_t kPointsPerTask = 512;

struct CodedPoint {
  std::uint64_t code;
  std::uint32_t index;
};

std::vector<CodedPoint> code_points(std::span<const Vector3> points, double voxel) {
  constexpr double kHalf = 1 << 20;  // Morton codes hold 21 bits an axis
  std::vector<CodedPoint> coded;
  coded.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3 v = (points[i] / voxel).array().floor() + kHalf;
    // NaN fails every comparison.
    if (!(v.minCoeff() >= 0.0 && v.maxCoeff() < 2.0 * kHalf)) continue;
    const auto integer = [](double c) { return static_cast<std::uint64_t>(c); };
    coded.push_back({morton_code(integer(v.x()), integer(v.y()), integer(v.z())),
                     static_cast<std::uint32_t>(i)});
  }
  return coded;
}

std::vector<Vector3> finite_points(std::span<const Vector3> points) {
  std::vector<Vector3> finite;
  finite.reserve(points.size());
  std::copy_if(points.begin(), points.end(), std::back_inserter(finite),
               [](const Vector3& p) { return p.allFinite(); });
  return finite;
}

/// Direction in which the neighbours of a point vary least.
Vector3 normal_of(const std::vector<Vector3>& points, const std::vector<std::uint32_t>& neighbours,
                  const Vector3& at) {
  Vector3 sum = Vector3::Zero();
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const std::uint32_t i : neighbours) {
    const Vector3 offset = points[i] - at;  // small numbers: their squares lose nothing
    sum += offset;
    moments += offset * offset.transpose();
  }
  const double n = static_cast<double>(neighbours.size());
  moments -= sum * sum.transpose() / n;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments);
  return solver.eigenvectors().col(0);
}

std::vector<Vector3> estimate_normals(const std::vector<Vector3>& points, const KdTree& tree,
                                      int num_threads) {
  std::vector<Vector3> normals(points.size());
  const std::size_t num_tasks = (points.size() + kPointsPerTask - 1) / kPointsPerTask;
  parallel_for(num_tasks, num_threads, [&](std::size_t task) {
    std::vector<std::uint32_t> neighbours;
    const std::size_t end = std::min(points.size(), (task + 1) * kPointsPerTask);
    for (std::size_t i = task * kPointsPerTask; i < end; ++i) {
      tree.nearest(points[i], SurfaceCloud::kNeighbors, neighbours);
      normals[i] = normal_of(points, neighbours, points[i]);
    }
  });
  return normals;
}

}  // namespace

std::vector<Vector3> voxel_means(std::span<const Vector3> points, double voxel) {
  if (!(voxel >= 0.0)) throw Error(ErrorCode::kUsage, "a voxel's edge cannot be negative");
  if (voxel == 0.0) return finite_points(points);
  std::vector<CodedPoint> coded = code_points(points, voxel);
  std::sort(coded.begin(), coded.end(), [](const CodedPoint& a, const CodedPoint& b) {
    return a.code != b.code ? a.code < b.code : a.index < b.index;
  });
  std::vector<Vector3> means;
  for (std::size_t begin = 0, end = 0; begin < coded.size(); begin = end) {
    Vector3 sum = Vector3::Zero();
    for (end = begin; end < coded.size() && coded[end].code == coded[begin].code; ++end) {
      sum += points[coded[end].index];
    }
    means.push_back(sum / static_cast<double>(end - begin));
  }
  return means;
}

SurfaceCloud::SurfaceCloud(std::span<const Vector3> points, double voxel, int num_threads)
    : points_(voxel_means(points, voxel)),
      tree_(points_),
      normals_(estimate_normals(points_, tree_, num_threads)) {}

}  // namespace gdfmap
