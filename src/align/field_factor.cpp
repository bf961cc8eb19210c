#include <algorithm>
#include <cmath>

#include <gdfmap/align/field_factor.hpp>

#include "chunked_sum.hpp"

namespace gdfmap {
namespace {

/// Below this, a gradient has no direction to speak of.
constexpr double kLeastGradient = 0.05;

bool rests_on_cubes(const FieldSample& sample) {
  return sample.status == FieldStatus::kFine || sample.status == FieldStatus::kCoarse;
}

Twist twist_of(const Vector3& s, const Vector3& direction) {
  Twist J;
  J << direction, s.cross(direction);
  return J;
}

}  // namespace

FieldFactor::FieldFactor(const DistanceField& field, const Vector3& origin_world,
                         const std::vector<Vector3>& source, const Options& options)
    : field_(field),
      origin_world_(origin_world),
      source_(source),
      options_(options),
      is_matched_(source.size(), 0) {}

std::vector<FieldSample> FieldFactor::samples_at(const Eigen::Isometry3d& T) const {
  std::vector<Vector3> points_world(source_.size());
  for (std::size_t i = 0; i < source_.size(); ++i) {
    points_world[i] = T * source_[i] + origin_world_;
  }
  std::vector<FieldSample> samples(points_world.size());
  field_.at(points_world, samples);
  return samples;
}

void FieldFactor::match(const Eigen::Isometry3d& T) {
  const std::vector<FieldSample> samples = samples_at(T);
  num_matched_ = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    is_matched_[i] = samples[i].status == FieldStatus::kFine ? 1 : 0;
    num_matched_ += is_matched_[i];
  }
}

Linearization FieldFactor::linearize(const Eigen::Isometry3d& T, const RobustKernel& kernel) const {
  const std::vector<FieldSample> samples = samples_at(T);
  const double outside_cost = kernel.cost(options_.max_distance);
  const Linearization total = chunked_sum<Linearization>(
      source_.size(), options_.num_threads, [&](std::size_t begin, std::size_t end) {
        Linearization sum;
        for (std::size_t i = begin; i < end; ++i) {
          // A step may have led a match out of the field.
          if (is_matched_[i] == 0 || !rests_on_cubes(samples[i])) {
            sum.cost += outside_cost;
            continue;
          }
          const double r = samples[i].distance, size = std::abs(r);
          const Vector3& g = samples[i].gradient;
          const double weight = kernel.weight(size);
          const Twist J = twist_of(T * source_[i], g);
          const Twist N = twist_of(T * source_[i], g / std::max(g.norm(), kLeastGradient));
          sum.cost += kernel.cost(size);
          sum.gradient += (weight * r) * J;
          sum.hessian += (weight * N) * N.transpose();
        }
        return sum;
      });
  return total.mean_over(source_.size());
}

double FieldFactor::cost(const Eigen::Isometry3d& T, const RobustKernel& kernel) const {
  return linearize(T, kernel).cost;
}

}  // namespace gdfmap
