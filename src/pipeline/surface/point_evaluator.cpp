#include "point_evaluator.hpp"

#include <algorithm>

#include <gdfmap/core/flush_to_zero.hpp>

namespace gdfmap::surface {

void PointEvaluator::evaluate(std::span<const Vector3> points_world, std::span<FieldValue> values) {
  std::ranges::fill(values, FieldValue{});
  shares_.assign(points_world.size(), {});
  collect_visits(points_world);
  if (!visits_.empty()) {
    const FlushToZero flush;
    const Neighbourhood cubes(field_.tiles, low_, high_);
    for (auto first = visits_.begin(); first != visits_.end();) {
      const auto last = std::find_if(first, visits_.end(),
                                     [&](const Visit& visit) { return visit.cube != first->cube; });
      if (const Neighbourhood::Cube* const cube = cubes.find(first->cube)) {
        const std::span<const Visit> of_cube(first, last);
        evaluate_cube(*cube, of_cube);
        for (std::size_t i = 0; i < of_cube.size(); ++i) {
          add(of_cube[i], i, cube->mae, values[of_cube[i].point]);
        }
      }
      first = last;
    }
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    // The quotient rule. Without any weight all of it becomes not-a-number.
    FieldValue& value = values[i];
    value.distance /= shares_[i].weight;
    value.gradient = (value.gradient - value.distance * shares_[i].gradient) / shares_[i].weight;
    value.expected_error /= shares_[i].weight;
  }
}

/// Sorted by cube, and by point within a cube: sums are taken in one order, whatever the points.
void PointEvaluator::collect_visits(std::span<const Vector3> points_world) {
  visits_.clear();
  for (std::size_t i = 0; i < points_world.size(); ++i) {
    if (const auto zone = field_.zones.zone_of(points_world[i])) {
      collect_visits(i, points_world[i], *zone);
    }
  }
  if (visits_.empty()) return;
  std::ranges::stable_sort(visits_, {}, [](const Visit& visit) { return visit.cube; });
  low_ = high_ = visits_.front().cube;
  for (const Visit& visit : visits_) {
    const CubeKey& cube = visit.cube;
    low_ = {0, std::min(low_.x, cube.x), std::min(low_.y, cube.y), std::min(low_.z, cube.z)};
    high_ = {0, std::max(high_.x, cube.x), std::max(high_.y, cube.y), std::max(high_.z, cube.z)};
  }
}

void PointEvaluator::collect_visits(std::size_t point, const Vector3& p_world,
                                    const BlendZone& zone) {
  const auto along = [&](int a) {
    return field_.zones.blend(zone.half_cubes[static_cast<std::size_t>(a)], p_world[a]);
  };
  std::size_t next = visits_.size();
  visit_cubes(zone, [&](const CubeKey& cube) {
    visits_.push_back({point, cube, Vector3::Zero(), 0.0, Vector3::Zero()});
  });
  visit_partition_of_unity(along(0), along(1), along(2), [&](const BlendTerm<double>& term) {
    Visit& visit = visits_[next++];
    visit.p_local = Vector3(term.p_local);
    visit.weight = term.weight;
    visit.weight_gradient = Vector3(term.weight_gradient);
  });
}

void PointEvaluator::evaluate_cube(const Neighbourhood::Cube& cube, std::span<const Visit> visits) {
  const std::size_t count = padded(visits.size());
  value_.resize(count);
  for (std::size_t a = 0; a < 3; ++a) {
    position_[a].resize(count);
    gradient_[a].resize(count);
    float* const end = std::ranges::transform(visits, position_[a].data(), [&](const Visit& visit) {
                         return static_cast<float>(visit.p_local[static_cast<int>(a)]);
                       }).out;
    std::fill(end, position_[a].data() + count, 0.0f);
  }
  field_.kernels.values_and_gradients(
      rows_.fill(cube.kernel), {count,
                                {position_[0].data(), position_[1].data(), position_[2].data()},
                                value_.data(),
                                {gradient_[0].data(), gradient_[1].data(), gradient_[2].data()}});
}

/// @param place  of the visit among those of its cube
void PointEvaluator::add(const Visit& visit, std::size_t place, double mae, FieldValue& sum) {
  const auto at = [place](AlignedFloats& floats) {
    return static_cast<double>(floats.data()[place]);
  };
  const double value = at(value_), weight = visit.weight;
  const Vector3 gradient(at(gradient_[0]), at(gradient_[1]), at(gradient_[2]));
  sum.distance += weight * value;
  sum.gradient += weight * gradient + value * visit.weight_gradient;
  sum.expected_error += weight * mae;
  shares_[visit.point].weight += weight;
  shares_[visit.point].gradient += visit.weight_gradient;
}

}  // namespace gdfmap::surface
