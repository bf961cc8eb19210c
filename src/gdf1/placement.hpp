#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/lattice.hpp>

namespace gdfmap::gdf1 {

/// Where cubes and Gaussians stand in a file: the one home of the rule that turns keys and
/// cube-local means (world lattice) into the file's shifted float32 coordinates and back.
/// Immutable.
class Placement {
 public:
  /// Empty unless cube_size is positive and finite and the shift a whole number of cubes, within a
  /// hundredth of one.
  [[nodiscard]] static std::optional<Placement> make(double cube_size, const Vector3& shift);

  [[nodiscard]] double cube_size() const { return cube_size_; }
  /// Exactly a whole number of cubes.
  [[nodiscard]] Vector3 shift() const;

  /// The float nearest to the cube's origin for which both floor((origin + 0.01 · size) / size) and
  /// floor(origin / size), in double with the header's float32 size, give the cube's index. Empty
  /// when the float32 steps there are too wide for the cube size.
  [[nodiscard]] std::optional<float> file_origin(std::int64_t key, std::size_t axis) const;
  [[nodiscard]] float file_mean(std::int64_t key, std::size_t axis, float local_mean) const;

  /// The key whose origin is within 1 % of the cube size (and the float32 rounding) of
  /// `file_origin`; empty when there is none, or it is out of the lattice's range.
  [[nodiscard]] std::optional<std::int64_t> key(float file_origin, std::size_t axis) const;
  [[nodiscard]] float local_mean(std::int64_t key, std::size_t axis, float file_mean) const;

 private:
  Placement(double cube_size, const std::array<std::int64_t, 3>& shift_cubes)
      : cube_size_(cube_size), shift_cubes_(shift_cubes) {}

  /// Of the cube's origin, in the file's frame.
  [[nodiscard]] double exact_origin(std::int64_t key, std::size_t axis) const {
    return static_cast<double>(key - shift_cubes_[axis]) * cube_size_;
  }

  double cube_size_;
  std::array<std::int64_t, 3> shift_cubes_;
};

}  // namespace gdfmap::gdf1
