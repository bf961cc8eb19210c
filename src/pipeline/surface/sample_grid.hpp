#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace gdfmap::surface {

using SampleIndex = std::array<std::int64_t, 3>;

/// Samples of a grid: those with begin ≤ index < end along each axis.
struct SampleBox {
  SampleIndex begin{}, end{};

  [[nodiscard]] std::size_t size(std::size_t axis) const {
    return end[axis] > begin[axis] ? static_cast<std::size_t>(end[axis] - begin[axis]) : 0;
  }
  [[nodiscard]] std::size_t count() const { return size(0) * size(1) * size(2); }
  [[nodiscard]] bool contains(const SampleIndex& index) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (index[axis] < begin[axis] || index[axis] >= end[axis]) return false;
    }
    return true;
  }
  [[nodiscard]] SampleBox intersection(const SampleBox& other) const {
    SampleBox common;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      common.begin[axis] = std::max(begin[axis], other.begin[axis]);
      common.end[axis] = std::min(end[axis], other.end[axis]);
    }
    return common;
  }
};

/// Samples at whole multiples of a resolution from the world's origin, along each axis. Which cube
/// a sample belongs to is decided here alone, so that none is lost or taken twice between cubes.
class SampleGrid {
 public:
  /// @param resolution, cube_size  metres, positive
  SampleGrid(double resolution, double cube_size)
      : resolution_(resolution), cube_size_(cube_size) {}

  [[nodiscard]] double resolution() const { return resolution_; }
  [[nodiscard]] double position(std::int64_t index) const {
    return static_cast<double>(index) * resolution_;
  }
  /// The least index whose position is not below this one.
  [[nodiscard]] std::int64_t first_from(double position) const;
  /// The first sample of the level-0 cubes with this coordinate.
  [[nodiscard]] std::int64_t first_in_cube(std::int64_t cube) const {
    return first_from(static_cast<double>(cube) * cube_size_);
  }
  /// The coordinate of the level-0 cubes that hold samples with this index.
  [[nodiscard]] std::int64_t cube_of(std::int64_t index) const;

 private:
  double resolution_, cube_size_;
};

}  // namespace gdfmap::surface
