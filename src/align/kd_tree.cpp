#include <limits>

#include <nanoflann.hpp>

#include <gdfmap/align/kd_tree.hpp>

namespace gdfmap {
namespace {

constexpr std::size_t kLeafPoints = 8;

struct Adaptor {
  std::span<const Vector3> points;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  [[nodiscard]] bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Adaptor>,
                                                 Adaptor, 3, std::uint32_t>;

/// nanoflann's result of a search for one point within a known distance.
struct NearestWithin {
  using DistanceType = double;

  double squared;
  std::optional<std::uint32_t> index;

  [[nodiscard]] double worstDist() const { return squared; }
  [[nodiscard]] bool full() const { return index.has_value(); }
  [[nodiscard]] std::size_t size() const { return index ? 1 : 0; }
  bool addPoint(double candidate_squared, std::uint32_t candidate) {
    if (candidate_squared < squared) {
      squared = candidate_squared;
      index = candidate;
    }
    return true;
  }
};

}  // namespace

struct KdTree::Impl {
  explicit Impl(std::span<const Vector3> points)
      : adaptor{points}, tree(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafPoints)) {}

  Adaptor adaptor;
  Tree tree;
};

KdTree::KdTree(std::span<const Vector3> points) : impl_(std::make_unique<Impl>(points)) {}
KdTree::~KdTree() = default;
KdTree::KdTree(KdTree&&) noexcept = default;

std::optional<std::uint32_t> KdTree::nearest(const Vector3& p, double max_distance,
                                             std::optional<std::uint32_t> guess) const {
  NearestWithin result{max_distance * max_distance, {}};
  if (guess) result.addPoint((impl_->adaptor.points[*guess] - p).squaredNorm(), *guess);
  impl_->tree.findNeighbors(result, p.data(), {});
  return result.index;
}

void KdTree::nearest(const Vector3& p, int k, std::vector<std::uint32_t>& indices) const {
  const auto count = static_cast<std::size_t>(k);
  indices.resize(count);
  std::vector<double> squared(count);
  nanoflann::KNNResultSet<double, std::uint32_t> result(count);
  result.init(indices.data(), squared.data());
  impl_->tree.findNeighbors(result, p.data(), {});
  indices.resize(result.size());
}

}  // namespace gdfmap
