#include <cmath>

#include <Eigen/LU>

#include <gdfmap/align/surface_factor.hpp>

#include "chunked_sum.hpp"

namespace gdfmap {
namespace {

/// C = I − (1 − f)·n nᵀ for both surfaces; the inverse of their sum.
Eigen::Matrix3d gicp_metric(const Vector3& n, const Vector3& m) {
  constexpr double kLess = 1.0 - SurfaceCloud::kFlatness;
  const Eigen::Matrix3d sum =
      2.0 * Eigen::Matrix3d::Identity() - kLess * (n * n.transpose() + m * m.transpose());
  return 2.0 * SurfaceCloud::kFlatness * sum.inverse();
}

/// Adds a residual along one direction: r = n·(s − q), J = [nᵀ, (s × n)ᵀ].
void add_plane(const Vector3& s, const Vector3& d, const Vector3& n, const RobustKernel& kernel,
               Linearization& sum) {
  const double r = n.dot(d);
  const double size = std::abs(r);
  const double weight = kernel.weight(size);
  Twist J;
  J << n, s.cross(n);
  sum.cost += kernel.cost(size);
  sum.gradient.noalias() += (weight * r) * J;
  sum.hessian.noalias() += (weight * J) * J.transpose();
}

/// Adds a residual √(dᵀ M d), J = [I, −[s]×].
void add_metric(const Vector3& s, const Vector3& d, const Eigen::Matrix3d& M,
                const RobustKernel& kernel, Linearization& sum) {
  const Vector3 Md = M * d;
  const double size = std::sqrt(std::max(0.0, d.dot(Md)));
  const double weight = kernel.weight(size);
  const Eigen::Matrix3d S = skew(s);
  const Eigen::Matrix3d WM = weight * M;
  const Eigen::Matrix3d cross = WM * S;
  sum.cost += kernel.cost(size);
  sum.gradient.head<3>() += weight * Md;
  sum.gradient.tail<3>() += weight * s.cross(Md);
  sum.hessian.topLeftCorner<3, 3>() += WM;
  sum.hessian.topRightCorner<3, 3>() -= cross;
  sum.hessian.bottomRightCorner<3, 3>() -= S * cross;
}

}  // namespace

SurfaceFactor::SurfaceFactor(const SurfaceCloud& target, const SurfaceCloud& source,
                             const Options& options)
    : target_(target), source_(source), options_(options), matches_(source.size()) {
  if (options.residual == SurfaceResidual::kGicp) metrics_.resize(source.size());
}

void SurfaceFactor::match(const Eigen::Isometry3d& T) {
  const auto match_chunk = [&](std::size_t begin, std::size_t end) {
    std::size_t found = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const Vector3 s = T * source_.points()[i];
      // The former match of this point bounds the search.
      matches_[i] = target_.tree().nearest(s, options_.max_distance, matches_[i]);
      if (!matches_[i]) continue;
      ++found;
      if (options_.residual != SurfaceResidual::kGicp) continue;
      metrics_[i] = gicp_metric(target_.normals()[*matches_[i]], T.linear() * source_.normals()[i]);
    }
    return found;
  };
  num_matched_ = chunked_sum<std::size_t>(source_.size(), options_.num_threads, match_chunk);
}

template <SurfaceResidual kResidual>
Linearization SurfaceFactor::sum(const Eigen::Isometry3d& T, const RobustKernel& kernel) const {
  const double unmatched_cost = kernel.cost(options_.max_distance);
  Linearization total = chunked_sum<Linearization>(
      source_.size(), options_.num_threads, [&](std::size_t begin, std::size_t end) {
        Linearization sum;
        for (std::size_t i = begin; i < end; ++i) {
          if (!matches_[i]) {
            sum.cost += unmatched_cost;
            continue;
          }
          const Vector3 s = T * source_.points()[i];
          const Vector3 d = s - target_.points()[*matches_[i]];
          if constexpr (kResidual == SurfaceResidual::kPlane) {
            add_plane(s, d, target_.normals()[*matches_[i]], kernel, sum);
          } else if constexpr (kResidual == SurfaceResidual::kPoint) {
            add_metric(s, d, Eigen::Matrix3d::Identity(), kernel, sum);
          } else {
            add_metric(s, d, metrics_[i], kernel, sum);
          }
        }
        return sum;
      });
  total.hessian = total.hessian.selfadjointView<Eigen::Upper>();
  return total;
}

Linearization SurfaceFactor::linearize(const Eigen::Isometry3d& T,
                                       const RobustKernel& kernel) const {
  Linearization total;
  switch (options_.residual) {
    case SurfaceResidual::kPoint:
      total = sum<SurfaceResidual::kPoint>(T, kernel);
      break;
    case SurfaceResidual::kPlane:
      total = sum<SurfaceResidual::kPlane>(T, kernel);
      break;
    case SurfaceResidual::kGicp:
      total = sum<SurfaceResidual::kGicp>(T, kernel);
      break;
  }
  return total.mean_over(source_.size());
}

double SurfaceFactor::cost(const Eigen::Isometry3d& T, const RobustKernel& kernel) const {
  const double unmatched_cost = kernel.cost(options_.max_distance);
  const auto cost_of = [&](std::size_t i) {
    if (!matches_[i]) return unmatched_cost;
    const std::uint32_t j = *matches_[i];
    const Vector3 d = T * source_.points()[i] - target_.points()[j];
    switch (options_.residual) {
      case SurfaceResidual::kPlane:
        return kernel.cost(std::abs(target_.normals()[j].dot(d)));
      case SurfaceResidual::kGicp:
        return kernel.cost(std::sqrt(std::max(0.0, d.dot(metrics_[i] * d))));
      case SurfaceResidual::kPoint:
        break;
    }
    return kernel.cost(d.norm());
  };
  const double sum = chunked_sum<double>(source_.size(), options_.num_threads,
                                         [&](std::size_t begin, std::size_t end) {
                                           double part = 0.0;
                                           for (std::size_t i = begin; i < end; ++i) {
                                             part += cost_of(i);
                                           }
                                           return part;
                                         });
  return sum / static_cast<double>(std::max<std::size_t>(1, source_.size()));
}

}  // namespace gdfmap
