#pragma once

#include <cstddef>
#include <vector>

namespace gdfmap::surface {

/// Floats that one vector register of any instruction set holds; rows for kernels are filled up to
/// a multiple of it.
inline constexpr std::size_t kLaneFloats = 16;

[[nodiscard]] constexpr std::size_t padded(std::size_t count) {
  return (count + kLaneFloats - 1) / kLaneFloats * kLaneFloats;
}

/// An array that starts on a vector register's boundary. Grows and is used again.
class AlignedFloats {
 public:
  /// What it held is lost. The floats have any value.
  void resize(std::size_t count) { lines_.resize(padded(count) / kLaneFloats); }
  [[nodiscard]] float* data() { return lines_.empty() ? nullptr : lines_.front().v; }
  [[nodiscard]] const float* data() const { return lines_.empty() ? nullptr : lines_.front().v; }

 private:
  struct alignas(kLaneFloats * sizeof(float)) Line {
    float v[kLaneFloats];
  };
  std::vector<Line> lines_;
};

}  // namespace gdfmap::surface
