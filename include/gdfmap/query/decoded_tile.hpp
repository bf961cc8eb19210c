#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include <gdfmap/field/gaussians.hpp>
#include <gdfmap/store/tile_record.hpp>

namespace gdfmap {

/// A tile made ready for evaluation: the kernel rows of each of its cubes side by side. Rows start
/// on 32 bytes and are filled up with Gaussians that are zero everywhere, so that whole registers
/// can be read. Immutable and thread-safe.
class DecodedTile {
 public:
  struct Cube {
    std::uint32_t first = 0;   ///< place of its first row, in units of kAlignedFloats
    std::uint32_t stride = 0;  ///< from row to row, in the same units: the count, rounded up
    std::uint32_t count = 0;   ///< number of Gaussians, 0 for a failed cube
    float mae = 0.0f;          ///< metres, NaN where unknown
    float max_error = 0.0f;    ///< metres, NaN where unknown
    CubeStatus status = CubeStatus::kFailed;
    CubeClass cube_class = CubeClass::kUnknown;
    bool is_attempted = false;
  };
  /// Floats in 32 bytes, the unit of strides.
  static constexpr std::size_t kAlignedFloats = 8;

  explicit DecodedTile(const TileRecord& tile);

  /// Attempted ones.
  [[nodiscard]] std::size_t num_cubes() const { return num_cubes_; }
  /// The cube with this index in [0, 512); null when it was not attempted.
  [[nodiscard]] const Cube* find(int index) const {
    const Cube& cube = cubes_[static_cast<std::size_t>(index)];
    return cube.is_attempted ? &cube : nullptr;
  }
  /// As find(), and null for a failed cube, which says nothing of the field.
  [[nodiscard]] const Cube* find_served(int index) const {
    const Cube& cube = cubes_[static_cast<std::size_t>(index)];
    return cube.count > 0 ? &cube : nullptr;
  }
  /// Valid as long as the tile. Positions are relative to the cube's minimum corner.
  [[nodiscard]] KernelView kernel(const Cube& cube) const {
    return {data_.get() + cube.first * kAlignedFloats, cube.stride * kAlignedFloats, cube.count};
  }
  /// What it occupies in memory.
  [[nodiscard]] std::size_t num_bytes() const;

 private:
  struct Free {
    void operator()(float* data) const;
  };

  std::array<Cube, kCubesPerTile> cubes_;  ///< by index, for one look-up instead of two
  std::size_t num_cubes_ = 0;
  std::unique_ptr<float[], Free> data_;
  std::size_t num_floats_ = 0;
};

}  // namespace gdfmap
