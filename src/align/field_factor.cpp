#include <algorithm>
#include <cmath>

#include <gdfmap/align/field_factor.hpp>

#include "chunked_sum.hpp"

namespace gdfmap {
namespace {

/// Below this, a gradient has no direction to speak of.
constexpr double kLeastGradient = 0.05;

/// The i-th of numbers that fill [0, 1) evenly, however many there are: multiples of the golden
/// ratio.
double spread(std::size_t i) {
  double whole = 0.0;
  return std::modf(0.6180339887498949 * static_cast<double>(i), &whole);
}

bool rests_on_cubes(const FieldSample& sample) {
  return sample.status == FieldStatus::kFine || sample.status == FieldStatus::kCoarse;
}

std::vector<FieldSample> samples_at(const DistanceField& field, const Vector3& origin_world,
                                    const Eigen::Isometry3d& T,
                                    const std::vector<Vector3>& points) {
  std::vector<Vector3> points_world(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) points_world[i] = T * points[i] + origin_world;
  std::vector<FieldSample> samples(points.size());
  field.at(points_world, samples);
  return samples;
}

/// The mean over all points of what add(i, sum) adds for those that are matched. Others, and those
/// where it is false, since a step led them out of the field, cost as much as one at max_distance.
template <typename Add>
Linearization mean_over_matches(const std::vector<std::uint8_t>& is_matched, double max_distance,
                                int num_threads, const RobustKernel& kernel, const Add& add) {
  const double outside_cost = kernel.cost(max_distance);
  const Linearization total = chunked_sum<Linearization>(
      is_matched.size(), num_threads, [&](std::size_t begin, std::size_t end) {
        Linearization sum;
        for (std::size_t i = begin; i < end; ++i) {
          if (is_matched[i] == 0 || !add(i, sum)) sum.cost += outside_cost;
        }
        return sum;
      });
  return total.mean_over(is_matched.size());
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

void FieldFactor::match(const Eigen::Isometry3d& T) {
  const std::vector<FieldSample> samples = samples_at(field_, origin_world_, T, source_);
  num_matched_ = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    is_matched_[i] = samples[i].status == FieldStatus::kFine ? 1 : 0;
    num_matched_ += is_matched_[i];
  }
}

Linearization FieldFactor::linearize(const Eigen::Isometry3d& T, const RobustKernel& kernel) const {
  const std::vector<FieldSample> samples = samples_at(field_, origin_world_, T, source_);
  const auto add = [&](std::size_t i, Linearization& sum) {
    if (!rests_on_cubes(samples[i])) return false;
    const double r = samples[i].distance, size = std::abs(r);
    const Vector3& g = samples[i].gradient;
    const double weight = kernel.weight(size);
    const Twist J = twist_of(T * source_[i], g);
    const Twist N = twist_of(T * source_[i], g / std::max(g.norm(), kLeastGradient));
    sum.cost += kernel.cost(size);
    sum.gradient += (weight * r) * J;
    sum.hessian += (weight * N) * N.transpose();
    return true;
  };
  return mean_over_matches(is_matched_, options_.max_distance, options_.num_threads, kernel, add);
}

double FieldFactor::cost(const Eigen::Isometry3d& T, const RobustKernel& kernel) const {
  return linearize(T, kernel).cost;
}

TwoSidedFieldFactor::TwoSidedFieldFactor(const DistanceField& field, const Vector3& origin_world,
                                         const SurfaceCloud& source, const Options& options)
    : field_(field), origin_world_(origin_world), options_(options), is_matched_(source.size(), 0) {
  half_widths_.reserve(source.size());
  sides_.reserve(2 * source.size());
  for (std::size_t i = 0; i < source.size(); ++i) {
    const double h = std::lerp(options.min_half_width, options.max_half_width, spread(i));
    const Vector3 side = h * source.normals()[i];
    half_widths_.push_back(h);
    sides_.push_back(source.points()[i] + side);
    sides_.push_back(source.points()[i] - side);
  }
}

void TwoSidedFieldFactor::match(const Eigen::Isometry3d& T) {
  const std::vector<FieldSample> samples = samples_at(field_, origin_world_, T, sides_);
  num_matched_ = 0;
  for (std::size_t i = 0; i < is_matched_.size(); ++i) {
    const FieldSample &front = samples[2 * i], &back = samples[2 * i + 1];
    const double h = half_widths_[i];
    const bool is_between = front.status == FieldStatus::kFine &&
                            back.status == FieldStatus::kFine &&
                            std::abs(front.distance + back.distance - 2.0 * h) < 0.5 * h;
    is_matched_[i] = is_between ? 1 : 0;
    num_matched_ += is_matched_[i];
  }
}

Linearization TwoSidedFieldFactor::linearize(const Eigen::Isometry3d& T,
                                             const RobustKernel& kernel) const {
  const std::vector<FieldSample> samples = samples_at(field_, origin_world_, T, sides_);
  const auto add = [&](std::size_t i, Linearization& sum) {
    const FieldSample &front = samples[2 * i], &back = samples[2 * i + 1];
    if (!rests_on_cubes(front) || !rests_on_cubes(back)) return false;
    const double r = 0.5 * (front.distance - back.distance);
    const double weight = kernel.weight(std::abs(r));
    const Twist J = 0.5 * (twist_of(T * sides_[2 * i], front.gradient) -
                           twist_of(T * sides_[2 * i + 1], back.gradient));
    sum.cost += kernel.cost(std::abs(r));
    sum.gradient += (weight * r) * J;
    sum.hessian += (weight * J) * J.transpose();
    return true;
  };
  return mean_over_matches(is_matched_, options_.max_distance, options_.num_threads, kernel, add);
}

double TwoSidedFieldFactor::cost(const Eigen::Isometry3d& T, const RobustKernel& kernel) const {
  return linearize(T, kernel).cost;
}

}  // namespace gdfmap
