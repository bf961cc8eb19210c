#include <cmath>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/lattice.hpp>

namespace gdfmap {
namespace {

constexpr double kMaxSteps = static_cast<double>(kMaxTileCoordinate) * kStepsPerTileAxis;

}  // namespace

CubeKey cube_at(const TileKey& tile, int index) {
  const int n = kCubesPerTileAxis;
  return {tile.level, std::int64_t{tile.x} * n + index % n,
          std::int64_t{tile.y} * n + index / n % n, std::int64_t{tile.z} * n + index / (n * n)};
}

LatticePoint tile_origin(const TileKey& tile) {
  const std::int64_t steps = kStepsPerTileAxis * level_scale(tile.level);
  return {tile.x * steps, tile.y * steps, tile.z * steps};
}

TileKey tile_of(const LatticePoint& p) {
  const auto key = [](std::int64_t v) {
    return static_cast<std::int32_t>(floor_div(v, kStepsPerTileAxis));
  };
  return {0, key(p.x), key(p.y), key(p.z)};
}

Lattice::Lattice(double cube_size) : cube_size_(cube_size), step_(cube_size / kStepsPerCubeAxis) {
  if (!std::isfinite(cube_size) || cube_size <= 0.0) {
    throw Error(ErrorCode::kUsage,
                "cube_size must be a positive number of metres, not " + std::to_string(cube_size));
  }
}

std::optional<LatticePoint> Lattice::quantize(const Vector3& p_world) const {
  const Vector3 steps = p_world / step_;
  // The negated comparison also refuses NaN.
  if (!(steps.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() < kMaxSteps)) return std::nullopt;
  return LatticePoint{std::llrint(steps.x()), std::llrint(steps.y()), std::llrint(steps.z())};
}

Vector3 Lattice::to_world(const LatticePoint& p) const {
  return Vector3(static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)) *
         step_;
}

Vector3 Lattice::cube_origin(const CubeKey& cube) const {
  return Vector3(static_cast<double>(cube.x), static_cast<double>(cube.y),
                 static_cast<double>(cube.z)) *
         cube_edge(cube.level);
}

Box3 Lattice::cube_box(const CubeKey& cube) const {
  const Vector3 origin = cube_origin(cube);
  return {origin, origin + Vector3::Constant(cube_edge(cube.level))};
}

Box3 Lattice::tile_box(const TileKey& tile) const {
  const Vector3 origin = cube_origin(cube_at(tile, 0));
  return {origin, origin + Vector3::Constant(cube_edge(tile.level) * kCubesPerTileAxis)};
}

std::size_t TileKeyHash::operator()(const TileKey& key) const noexcept {
  // Odd multipliers, then the finaliser of SplitMix64.
  std::uint64_t h = static_cast<std::uint32_t>(key.x) * 0x9e3779b97f4a7c15u;
  h ^= static_cast<std::uint32_t>(key.y) * 0xc2b2ae3d27d4eb4fu;
  h ^= static_cast<std::uint32_t>(key.z) * 0x165667b19e3779f9u;
  h += static_cast<std::uint32_t>(key.level);
  h = (h ^ h >> 30) * 0xbf58476d1ce4e5b9u;
  h = (h ^ h >> 27) * 0x94d049bb133111ebu;
  return static_cast<std::size_t>(h ^ h >> 31);
}

}  // namespace gdfmap
