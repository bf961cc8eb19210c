#pragma once

#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap {

inline constexpr int kCubesPerTileAxis = 8;
inline constexpr int kCubesPerTile = kCubesPerTileAxis * kCubesPerTileAxis * kCubesPerTileAxis;
inline constexpr int kStepsPerTileAxis = 65536;  ///< quantisation steps along a level-0 tile
inline constexpr int kStepsPerCubeAxis = kStepsPerTileAxis / kCubesPerTileAxis;
inline constexpr int kLevelRatio =
    4;  ///< a cube of level n + 1 is 4 times as long as one of level n
inline constexpr int kMaxLevels = 3;          ///< levels 0, 1 and 2
inline constexpr double kMarginRatio = 0.25;  ///< margin of a trained cube over its edge

/// Shape of a map, fixed when it is created. Lengths in metres.
struct Geometry {
  double cube_size = 1.0;  ///< edge of a level-0 cube
  double margin =
      kMarginRatio;  ///< blending margin of a level-0 cube; kMarginRatio · cube_size where
                     ///< gdfmap trains, whatever its header says for an imported map
  int num_levels = kMaxLevels;

  bool operator==(const Geometry&) const = default;
};

/// A point on the quantisation lattice: whole steps from the world's origin.
struct LatticePoint {
  std::int64_t x = 0, y = 0, z = 0;
  auto operator<=>(const LatticePoint&) const = default;
};

/// Tile (x, y, z) of level n spans [x, x + 1) · 8 · cube_size · 4ⁿ, and so on for y and z.
/// The order of tiles and cubes in every listing is this one: level, then x, y, z.
struct TileKey {
  std::int32_t level = 0, x = 0, y = 0, z = 0;
  auto operator<=>(const TileKey&) const = default;
};

/// Cube (x, y, z) of level n spans [x, x + 1) · cube_size · 4ⁿ.
struct CubeKey {
  std::int32_t level = 0;
  std::int64_t x = 0, y = 0, z = 0;
  auto operator<=>(const CubeKey&) const = default;
};

/// Largest |key| of a level-0 tile along an axis (2³⁰): room for neighbours in 32 bits.
inline constexpr std::int64_t kMaxTileCoordinate = std::int64_t{1} << 30;

/// Floor division; the divisor is positive.
[[nodiscard]] constexpr std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a / b - (a % b < 0 ? 1 : 0);
}

/// ⌊v⌋ for |v| < 2⁶³, without a call to the library.
[[nodiscard]] constexpr std::int64_t floor_to_integer(double v) {
  const auto truncated = static_cast<std::int64_t>(v);
  return truncated - (v < static_cast<double>(truncated) ? 1 : 0);
}

/// 4ⁿ.
[[nodiscard]] constexpr std::int64_t level_scale(int level) {
  return std::int64_t{1} << (2 * level);
}

/// Where a cube lies in its tile: x + 8 · (y + 8 · z), in [0, 512).
[[nodiscard]] constexpr int cube_index(int x, int y, int z) {
  return x + kCubesPerTileAxis * (y + kCubesPerTileAxis * z);
}

[[nodiscard]] constexpr TileKey tile_of(const CubeKey& cube) {
  const auto tile = [](std::int64_t c) {
    return static_cast<std::int32_t>(floor_div(c, kCubesPerTileAxis));
  };
  return {cube.level, tile(cube.x), tile(cube.y), tile(cube.z)};
}
[[nodiscard]] constexpr int cube_index_in_tile(const CubeKey& cube) {
  const auto within = [](std::int64_t c) {
    return static_cast<int>(c - floor_div(c, kCubesPerTileAxis) * kCubesPerTileAxis);
  };
  return cube_index(within(cube.x), within(cube.y), within(cube.z));
}
[[nodiscard]] CubeKey cube_at(const TileKey& tile, int index);

/// Rounds world coordinates (double, metres) to the world lattice and back. The lattice is anchored
/// at world zero: keys and quantised coordinates depend on nothing but the point and the cube size.
/// Immutable and thread-safe.
class Lattice {
 public:
  /// @throws Error kUsage unless cube_size is finite and positive.
  explicit Lattice(double cube_size);

  [[nodiscard]] double cube_size() const { return cube_size_; }
  [[nodiscard]] double cube_edge(int level) const {
    return cube_size_ * static_cast<double>(level_scale(level));
  }
  /// Length of one quantisation step: tile edge / 65536 = cube_size / 8192.
  [[nodiscard]] double step() const { return step_; }

  /// Nearest lattice point; empty when a coordinate is not finite or beyond kMaxTileCoordinate
  /// tiles.
  [[nodiscard]] std::optional<LatticePoint> quantize(const Vector3& p_world) const;
  [[nodiscard]] Vector3 to_world(const LatticePoint& p) const;

  /// The cube of `level` that holds a world point; empty as for quantize. Not rounded to the
  /// lattice: for queries, where quantize-then-split is for points.
  [[nodiscard]] std::optional<CubeKey> cube_containing(const Vector3& p_world, int level) const {
    const Vector3 cubes = p_world / cube_edge(level);
    constexpr double kEnd = static_cast<double>(kMaxTileCoordinate) * kCubesPerTileAxis;
    // NaN fails every comparison.
    if (!(std::abs(cubes.x()) < kEnd && std::abs(cubes.y()) < kEnd && std::abs(cubes.z()) < kEnd)) {
      return std::nullopt;
    }
    return CubeKey{level, floor_to_integer(cubes.x()), floor_to_integer(cubes.y()),
                   floor_to_integer(cubes.z())};
  }

  [[nodiscard]] Vector3 cube_origin(const CubeKey& cube) const;
  [[nodiscard]] Box3 cube_box(const CubeKey& cube) const;
  [[nodiscard]] Box3 tile_box(const TileKey& tile) const;

 private:
  double cube_size_;
  double step_;
};

/// First lattice point of a tile, in level-0 steps.
[[nodiscard]] LatticePoint tile_origin(const TileKey& tile);

/// The level-0 tile that holds a lattice point.
[[nodiscard]] TileKey tile_of(const LatticePoint& p);

struct TileKeyHash {
  [[nodiscard]] std::size_t operator()(const TileKey& key) const noexcept;
};

}  // namespace gdfmap
