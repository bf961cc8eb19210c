#include "point_evaluator.hpp"

#include <algorithm>
#include <numeric>

#include <gdfmap/core/flush_to_zero.hpp>

namespace gdfmap::surface {

void PointEvaluator::evaluate(std::span<const Vector3> points_world, std::span<FieldValue> values) {
  std::ranges::fill(values, FieldValue{});
  shares_.assign(points_world.size(), {});
  collect_visits(points_world);
  if (!visits_.empty()) {
    const FlushToZero flush;
    const Neighbourhood cubes(field_.tiles, low_, high_);
    sort_visits(cubes);
    for (std::size_t place = 0; place < cubes.num_places(); ++place) {
      const std::span<const std::uint32_t> of_cube = visits_of(place);
      const Neighbourhood::Cube* const cube = cubes.at(place);
      if (of_cube.empty() || cube == nullptr) continue;
      evaluate_cube(*cube, of_cube);
      for (std::size_t i = 0; i < of_cube.size(); ++i) {
        const Visit& visit = visits_[of_cube[i]];
        add(visit, i, cube->mae, values[visit.point]);
      }
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

void PointEvaluator::collect_visits(std::span<const Vector3> points_world) {
  visits_.clear();
  for (std::size_t i = 0; i < points_world.size(); ++i) {
    if (const auto zone = field_.zones.zone_of(points_world[i])) {
      collect_visits(i, points_world[i], *zone);
    }
  }
  if (visits_.empty()) return;
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

/// Cube by cube in key order, and by point within a cube: sums are taken in one order, whatever the
/// points.
void PointEvaluator::sort_visits(const Neighbourhood& cubes) {
  std::vector<std::uint32_t>& begins = ends_;  // which become the ends as visits are put in
  begins.assign(cubes.num_places(), 0);
  for (const Visit& visit : visits_) ++begins[cubes.place_of(visit.cube)];
  std::exclusive_scan(begins.begin(), begins.end(), begins.begin(), std::uint32_t{0});
  order_.resize(visits_.size());
  for (std::uint32_t i = 0; i < visits_.size(); ++i) {
    order_[ends_[cubes.place_of(visits_[i].cube)]++] = i;
  }
}

std::span<const std::uint32_t> PointEvaluator::visits_of(std::size_t cube) const {
  const std::uint32_t begin = cube == 0 ? 0 : ends_[cube - 1];
  return std::span(order_).subspan(begin, ends_[cube] - begin);
}

void PointEvaluator::evaluate_cube(const Neighbourhood::Cube& cube,
                                   std::span<const std::uint32_t> visits) {
  const std::size_t count = padded(visits.size());
  value_.resize(count);
  for (std::size_t a = 0; a < 3; ++a) {
    position_[a].resize(count);
    gradient_[a].resize(count);
    float* const end =
        std::ranges::transform(visits, position_[a].data(), [&](std::uint32_t visit) {
          return static_cast<float>(visits_[visit].p_local[static_cast<int>(a)]);
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
