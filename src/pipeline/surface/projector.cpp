#include "projector.hpp"

#include <algorithm>
#include <cmath>

namespace gdfmap::surface {
namespace {

Vector3 stepped(const Vector3& position, const FieldValue& value) {
  return position - value.distance / std::max(1.0, value.gradient.squaredNorm()) * value.gradient;
}

}  // namespace

std::span<const ProjectedPoint> Projector::project(std::span<const Vector3> points_world,
                                                   int num_steps) {
  const std::size_t count = points_world.size();
  values_.resize(count);
  new_values_.resize(count);
  moved_.resize(count);
  projected_.resize(count);
  evaluator_.evaluate(points_world, values_);
  for (std::size_t i = 0; i < count; ++i) {
    projected_[i].position = points_world[i];
    const double slope = values_[i].gradient.norm();
    projected_[i].normal = slope > 0.0 ? Vector3(values_[i].gradient / slope) : Vector3::Zero();
  }
  for (int step = 0; step < num_steps; ++step) {
    for (std::size_t i = 0; i < count; ++i) moved_[i] = stepped(projected_[i].position, values_[i]);
    evaluator_.evaluate(moved_, new_values_);
    for (std::size_t i = 0; i < count; ++i) {
      if (!(std::abs(new_values_[i].distance) < std::abs(values_[i].distance))) continue;
      projected_[i].position = moved_[i];
      values_[i] = new_values_[i];
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    projected_[i].distance = values_[i].distance;
    projected_[i].expected_error = values_[i].expected_error;
  }
  return projected_;
}

}  // namespace gdfmap::surface
