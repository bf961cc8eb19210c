#include "distance_scale.hpp"

#include <algorithm>
#include <cmath>

#include "ticks.hpp"

namespace gdfmap::drawing {
namespace {

constexpr double kTicks = 7.0;
/// Between iso-lines, as a share of the picture's longer side: distances change by a metre a metre,
/// so this is where neighbouring lines, and the labels on them, still stand apart.
constexpr double kMinIsoSpacing = 0.0095;
/// Surfaces pass half a sample from the nearest one at most (0.71 along diagonals).
constexpr double kSurfaceSamples = 0.75;
/// A field that is fitted does not reach 0 on its surfaces.
constexpr double kSurfaceShareOfScale = 0.006;

bool is_lower_bound(const SliceImage& slice, std::size_t i) {
  return !slice.is_bound.empty() && slice.is_bound[i] != 0;
}

}  // namespace

std::vector<double> DistanceScale::ticks() const {
  return multiples(tick_step, end - 0.5 * tick_step, tick_step);
}

std::vector<double> DistanceScale::iso_levels() const {
  return multiples(iso_step, end - 0.5 * tick_step, iso_step);
}

DistanceScale distance_scale(const SliceImage& slice) {
  DistanceScale scale;
  double nearest = INFINITY, largest = 0.0, largest_bound = 0.0;
  for (std::size_t i = 0; i < slice.distance.size(); ++i) {
    const auto d = static_cast<double>(slice.distance[i]);
    const bool is_bound = is_lower_bound(slice, i);
    if (!std::isfinite(d)) {
      scale.has_unknown = true;
    } else if (is_bound) {
      scale.has_bound = true;
      largest_bound = std::max(largest_bound, d);
    } else {
      nearest = std::min(nearest, d);
      largest = std::max(largest, d);
    }
  }
  largest = std::max(largest, slice.largest_distance);
  const double shown = largest > 0.0 ? largest : largest_bound;
  if (shown > 0.0) scale.end = round_end(shown);
  scale.exceeds_end = largest_bound > scale.end;
  scale.tick_step = round_step(scale.end / kTicks);
  const double side = slice.resolution * std::max(slice.width, slice.height);
  scale.iso_step = std::max(scale.tick_step, round_step(kMinIsoSpacing * side));
  scale.surface = std::max(kSurfaceSamples * slice.resolution, kSurfaceShareOfScale * scale.end);
  scale.has_surface = nearest < scale.surface;
  return scale;
}

}  // namespace gdfmap::drawing

namespace gdfmap {

double largest_estimate(const SliceImage& slice) {
  double largest = 0.0;
  for (std::size_t i = 0; i < slice.distance.size(); ++i) {
    const auto d = static_cast<double>(slice.distance[i]);
    if (std::isfinite(d) && !drawing::is_lower_bound(slice, i)) largest = std::max(largest, d);
  }
  return largest;
}

}  // namespace gdfmap
