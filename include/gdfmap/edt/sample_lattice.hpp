#pragma once

#include <cstdint>

#include <gdfmap/core/lattice.hpp>

namespace gdfmap {

/// Where the distance is sampled for a fit. Training samples lie on one world lattice, h = 1/8 of
/// the edge apart and offset by h/2, so that neighbouring cubes share them: 12 an axis over cube
/// and margin. Held-out samples are (i + ½)/6 of the edge inside the cube. Both are rounded to the
/// quantisation lattice.
inline constexpr int kSamplesPerEdge = 8;
inline constexpr int kMarginSamples = 2;
inline constexpr int kSamplesPerAxis = kSamplesPerEdge + 2 * kMarginSamples;
inline constexpr int kNumSamples = kSamplesPerAxis * kSamplesPerAxis * kSamplesPerAxis;
inline constexpr int kHeldOutPerAxis = 6;
inline constexpr int kNumHeldOut = kHeldOutPerAxis * kHeldOutPerAxis * kHeldOutPerAxis;
/// Samples along a tile: those of its 8 cubes and one margin at either end.
inline constexpr int kTileSamplesPerAxis = kCubesPerTileAxis * kSamplesPerEdge + 2 * kMarginSamples;

/// Quantisation steps along a cube of a level.
[[nodiscard]] constexpr std::int64_t steps_per_cube(int level) {
  return kStepsPerCubeAxis * level_scale(level);
}

/// Sample i of an axis, in steps from the minimum of the cube or tile that it is counted from; i =
/// 0 is the outermost sample of the margin.
[[nodiscard]] constexpr std::int64_t sample_offset(int i, int level) {
  return (2 * (i - kMarginSamples) + 1) * steps_per_cube(level) / (2 * kSamplesPerEdge);
}

/// Held-out sample i of an axis, in steps from the cube's minimum, rounded to nearest.
[[nodiscard]] constexpr std::int64_t held_out_offset(int i, int level) {
  return ((2 * i + 1) * steps_per_cube(level) + kHeldOutPerAxis) / (2 * kHeldOutPerAxis);
}

/// The same as fractions of the edge, which no level changes but for rounding.
[[nodiscard]] constexpr double sample_position(int i) {
  return static_cast<double>(sample_offset(i, 0)) / kStepsPerCubeAxis;
}
[[nodiscard]] constexpr double held_out_position(int i, int level) {
  return static_cast<double>(held_out_offset(i, level)) /
         static_cast<double>(steps_per_cube(level));
}

}  // namespace gdfmap
