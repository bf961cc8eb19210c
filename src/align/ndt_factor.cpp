#include <algorithm>
#include <array>
#include <cmath>

#include <gdfmap/align/ndt_factor.hpp>

#include "chunked_sum.hpp"

namespace gdfmap {
namespace {

/// Sums of a point over its cells: what it gains, Σ w·Cq and Σ w·(C − d2·(Cq)(Cq)ᵀ), with
/// w = −d1·d2·e: the derivatives of its cost in its own position.
struct PointModel {
  double gain = 0.0;
  Vector3 gradient = Vector3::Zero();
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
};

/// exp(−30) = 1e-13 of what a cell gives at its mean: most neighbours of a point are flat cells
/// that lie farther off, and take no exponential.
constexpr double kMostExponent = 30.0;

void add_cell(const NdtCell& cell, const Vector3& p, const NdtConstants& k, PointModel& model) {
  const Vector3 q = p - cell.mean;
  const Vector3 Cq = cell.inverse_covariance * q;
  const double exponent = 0.5 * k.d2 * q.dot(Cq);
  if (exponent > kMostExponent) return;
  const double e = std::exp(-exponent);
  const double weight = -k.d1 * k.d2 * e;
  model.gain += -k.d1 * e;
  model.gradient += weight * Cq;
  model.hessian += weight * cell.inverse_covariance - (weight * k.d2) * Cq * Cq.transpose();
}

/// The chain rule from a point's position to the pose: with y = R·x,
/// q_v = I, q_ω = −[y]×, q_ωω(a, b) = ½(e_a × (e_b × y) + e_b × (e_a × y)), q_vω = 0.
void add_point(const PointModel& model, const Vector3& y, Linearization& sum) {
  const Eigen::Matrix3d Y = skew(y);
  const Eigen::Matrix3d cross = model.hessian * Y;
  const Vector3& g = model.gradient;
  sum.gradient.head<3>() += g;
  sum.gradient.tail<3>() += y.cross(g);
  sum.hessian.topLeftCorner<3, 3>() += model.hessian;
  sum.hessian.topRightCorner<3, 3>() -= cross;
  // g·q_ωω(a, b) = ½(g_b y_a + g_a y_b) − δ_ab g·y, by the rule for double cross products.
  sum.hessian.bottomRightCorner<3, 3>() += -Y * cross +
                                           0.5 * (y * g.transpose() + g * y.transpose()) -
                                           g.dot(y) * Eigen::Matrix3d::Identity();
}

}  // namespace

NdtConstants NdtConstants::of(double resolution, double outlier_ratio) {
  const double c1 = 10.0 * (1.0 - outlier_ratio);
  const double c2 = outlier_ratio / (resolution * resolution * resolution);
  NdtConstants k;
  k.d3 = -std::log(c2);
  k.d1 = -std::log(c1 + c2) - k.d3;
  k.d2 = -2.0 * std::log((-std::log(c1 * std::exp(-0.5) + c2) - k.d3) / k.d1);
  return k;
}

NdtFactor::NdtFactor(const NdtCells& target, const std::vector<Vector3>& source,
                     const Options& options)
    : target_(target),
      source_(source),
      options_(options),
      constants_(NdtConstants::of(target.voxel_edge())),
      stride_(options.neighborhood == NdtNeighborhood::kOwn ? 1 : 7),
      cells_(source.size() * stride_, nullptr) {}

void NdtFactor::match(const Eigen::Isometry3d& T) {
  num_matched_ = chunked_sum<std::size_t>(
      source_.size(), options_.num_threads, [&](std::size_t begin, std::size_t end) {
        std::array<const NdtCell*, kMaxNdtNeighbors> found{};
        std::size_t num_matched = 0;
        for (std::size_t i = begin; i < end; ++i) {
          const std::size_t count = target_.around(T * source_[i], options_.neighborhood, found);
          for (std::size_t k = 0; k < stride_; ++k) {
            cells_[i * stride_ + k] = k < count ? found[k] : nullptr;
          }
          if (count > 0) ++num_matched;
        }
        return num_matched;
      });
}

Eigen::Isometry3d NdtFactor::retract(const Eigen::Isometry3d& T, const Twist& step) const {
  Eigen::Isometry3d result = T;
  const Eigen::Matrix3d rotation = exp_rotation(step.tail<3>()) * T.linear();
  result.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  result.translation() += step.head<3>();
  return result;
}

Linearization NdtFactor::linearize(const Eigen::Isometry3d& T, const RobustKernel&) const {
  Linearization total = chunked_sum<Linearization>(
      source_.size(), options_.num_threads, [&](std::size_t begin, std::size_t end) {
        Linearization sum;
        for (std::size_t i = begin; i < end; ++i) {
          PointModel model;
          const Vector3 y = T.linear() * source_[i];
          const NdtCell* const* const cells = cells_.data() + i * stride_;
          for (std::size_t k = 0; k < stride_ && cells[k] != nullptr; ++k) {
            add_cell(*cells[k], y + T.translation(), constants_, model);
          }
          sum.cost += -constants_.d1 - model.gain;
          if (cells[0] != nullptr) add_point(model, y, sum);
        }
        return sum;
      });
  total.hessian = total.hessian.selfadjointView<Eigen::Upper>();
  return total.mean_over(source_.size());
}

double NdtFactor::cost(const Eigen::Isometry3d& T, const RobustKernel& kernel) const {
  return linearize(T, kernel).cost;
}

}  // namespace gdfmap
