#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include <gdfmap/core/error.hpp>
#include <gdfmap/gdf1/model.hpp>

#include "format.hpp"

namespace gdfmap {
namespace {

/// Bounds are multiples of the cube size up to rounding, which must not cost 1024 cubes.
constexpr double kRoundingSlack = 1e-3;

std::string decimals(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof(text), "%.*f", digits, value);
  return text;
}

double largest_coordinate(const Box3& bounds) {
  return std::max(bounds.min().cwiseAbs().maxCoeff(), bounds.max().cwiseAbs().maxCoeff());
}

double floor_to_shift(double minimum, double cube_size) {
  const double cubes = std::floor(minimum / cube_size + kRoundingSlack);
  const auto multiple = static_cast<double>(gdf1::kShiftCubes);
  return std::floor(cubes / multiple) * multiple * cube_size;
}

/// Of the floats just below a magnitude.
double float_step(double magnitude) {
  const auto value = static_cast<float>(magnitude);
  return static_cast<double>(value) - static_cast<double>(std::nextafter(value, 0.0f));
}

}  // namespace

Vector3 export_shift(const Box3& bounds, double cube_size) {
  if (bounds.isEmpty()) return Vector3::Zero();
  const double extent = bounds.sizes().maxCoeff();
  if (!(extent <= kMaxExtent)) {
    throw Error(ErrorCode::kUsage, "the exported cubes extend over " + decimals(extent, 0) +
                                       " m; float32 carries " + decimals(kMaxExtent, 0) +
                                       " m at most: export parts of the map with --region");
  }
  if (largest_coordinate(bounds) < kMaxUnshiftedBound) return Vector3::Zero();
  return bounds.min().unaryExpr([&](double v) { return floor_to_shift(v, cube_size); });
}

std::optional<std::string> export_warning(const Box3& bounds, double cube_size) {
  if (bounds.isEmpty()) return std::nullopt;
  const Vector3 shift = export_shift(bounds, cube_size);
  const double largest = largest_coordinate(Box3(bounds.min() - shift, bounds.max() - shift));
  const double extent = bounds.sizes().maxCoeff();
  if (extent <= kMaxPreciseExtent && largest <= kMaxPreciseExtent) return std::nullopt;
  const double step_mm = 1e3 * float_step(largest);
  return "the exported cubes extend over " + decimals(extent, 0) +
         " m: float32 coordinates have steps of up to " + decimals(step_mm, 2) +
         " mm; parts of the map (--region) are finer";
}

}  // namespace gdfmap
