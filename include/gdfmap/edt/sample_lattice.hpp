#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <gdfmap/core/lattice.hpp>

namespace gdfmap {

/// Quantisation steps along a cube of a level.
[[nodiscard]] constexpr std::int64_t steps_per_cube(int level) {
  return kStepsPerCubeAxis * level_scale(level);
}

/// Where the distance is sampled for a fit: a regular grid over a cube and its margin, `per_edge`
/// samples along the edge, the outermost half a spacing off the faces, and `margin` more beyond
/// either face. The samples lie on one lattice of the world, so that neighbouring cubes share them,
/// rounded to the quantisation lattice. A coarser grid inside the cube, `held_out` samples along
/// the edge, is what the fit does not see, and is judged by.
struct TrainingGrid {
  int per_edge, margin, held_out;

  [[nodiscard]] constexpr int per_axis() const { return per_edge + 2 * margin; }
  [[nodiscard]] constexpr std::size_t size() const {
    const auto n = static_cast<std::size_t>(per_axis());
    return n * n * n;
  }
  /// Sample i of an axis, in steps from the minimum of the cube or tile that it is counted from; i
  /// = 0 is the outermost sample of the margin.
  [[nodiscard]] constexpr std::int64_t offset(int i, int level) const {
    return floor_div((2 * (i - margin) + 1) * steps_per_cube(level) + per_edge, 2 * per_edge);
  }
  /// The same as a fraction of the edge, which no level changes but for rounding.
  [[nodiscard]] constexpr double position(int i) const {
    return static_cast<double>(offset(i, 0)) / kStepsPerCubeAxis;
  }

  [[nodiscard]] constexpr std::size_t num_held_out() const {
    const auto n = static_cast<std::size_t>(held_out);
    return n * n * n;
  }
  /// Held-out sample i of an axis, in steps from the cube's minimum, rounded to nearest.
  [[nodiscard]] constexpr std::int64_t held_out_offset(int i, int level) const {
    return ((2 * i + 1) * steps_per_cube(level) + held_out) / (2 * held_out);
  }
  /// The same as a fraction of the edge.
  [[nodiscard]] constexpr double held_out_position(int i, int level) const {
    return static_cast<double>(held_out_offset(i, level)) /
           static_cast<double>(steps_per_cube(level));
  }

  bool operator==(const TrainingGrid&) const = default;
};

/// Where points are, the distance has a valley as sharp as the surface; elsewhere it is smooth, and
/// the samples may stand farther apart. Those held out stand as close as elsewhere: 4 an edge, 6 %
/// less time, let conservative distances exceed the truth twice as often.
inline constexpr TrainingGrid kPopulatedGrid{12, 2, 6}, kEmptyGrid{8, 2, 6};
inline constexpr std::array kTrainingGrids = {kPopulatedGrid, kEmptyGrid};
[[nodiscard]] constexpr const TrainingGrid& training_grid(bool populated) {
  return kTrainingGrids[populated ? 0 : 1];
}

}  // namespace gdfmap
