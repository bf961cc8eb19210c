#include "placement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gdfmap::gdf1 {
namespace {

constexpr std::int64_t kMaxKey = kMaxTileCoordinate * kCubesPerTileAxis;
constexpr double kLatticeTolerance = 0.01;  // of a cube: what consumers allow for
/// Beyond this share of a cube the rounding of float32 origins no longer tells neighbours apart.
constexpr double kMaxLatticeTolerance = 0.25;

float next_up(float value) { return std::nextafter(value, std::numeric_limits<float>::infinity()); }

double float_step(float value) {
  const float magnitude = std::abs(value);
  return static_cast<double>(next_up(magnitude)) - static_cast<double>(magnitude);
}

/// The two ways in which consumers recover a cube's index.
bool consumers_agree(float origin, std::int64_t index, double size) {
  const auto expected = static_cast<double>(index);
  const auto o = static_cast<double>(origin);
  return std::floor(o / size) == expected && std::floor((o + 0.01 * size) / size) == expected;
}

}  // namespace

std::optional<Placement> Placement::make(double cube_size, const Vector3& shift) {
  if (!std::isfinite(cube_size) || cube_size <= 0.0) return std::nullopt;
  std::array<std::int64_t, 3> shift_cubes{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double cubes = shift[static_cast<Eigen::Index>(a)] / cube_size;
    if (!(std::abs(cubes) <= static_cast<double>(kMaxKey))) return std::nullopt;
    shift_cubes[a] = std::llround(cubes);
    if (std::abs(cubes - static_cast<double>(shift_cubes[a])) > kLatticeTolerance) {
      return std::nullopt;
    }
  }
  return Placement(cube_size, shift_cubes);
}

Vector3 Placement::shift() const {
  return Vector3(static_cast<double>(shift_cubes_[0]), static_cast<double>(shift_cubes_[1]),
                 static_cast<double>(shift_cubes_[2])) *
         cube_size_;
}

std::optional<float> Placement::file_origin(std::int64_t key, std::size_t axis) const {
  const std::int64_t index = key - shift_cubes_[axis];
  const auto header_size = static_cast<double>(static_cast<float>(cube_size_));
  auto origin = static_cast<float>(exact_origin(key, axis));
  // Rounding down, or a header size rounded up, puts the origin a few steps too low, never too
  // high.
  constexpr int kMaxSteps = 4;
  for (int step = 0; step < kMaxSteps; ++step, origin = next_up(origin)) {
    if (consumers_agree(origin, index, header_size)) return origin;
  }
  return std::nullopt;
}

float Placement::file_mean(std::int64_t key, std::size_t axis, float local_mean) const {
  return static_cast<float>(exact_origin(key, axis) + static_cast<double>(local_mean));
}

std::optional<std::int64_t> Placement::key(float file_origin, std::size_t axis) const {
  const auto origin = static_cast<double>(file_origin);
  const double cubes = origin / cube_size_;
  // The negated comparison also refuses NaN.
  if (!(std::abs(cubes) <= static_cast<double>(kMaxKey))) return std::nullopt;
  const std::int64_t key = std::llround(cubes) + shift_cubes_[axis];
  if (key < -kMaxKey || key >= kMaxKey) return std::nullopt;
  const double tolerance = std::min(kLatticeTolerance * cube_size_ + 2.0 * float_step(file_origin),
                                    kMaxLatticeTolerance * cube_size_);
  if (std::abs(origin - exact_origin(key, axis)) > tolerance) return std::nullopt;
  return key;
}

float Placement::local_mean(std::int64_t key, std::size_t axis, float file_mean) const {
  return static_cast<float>(static_cast<double>(file_mean) - exact_origin(key, axis));
}

}  // namespace gdfmap::gdf1
