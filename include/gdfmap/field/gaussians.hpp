#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap {

/// Rows of the structure of arrays that holds the Gaussians of a cube or of a tile.
enum GaussianRow : std::size_t {
  kMeanX = 0,       ///< metres from the cube's minimum corner
  kRootSigmaX = 3,  ///< square root of the standard deviation, √m: the variance is its fourth power
  kWeight = 6,      ///< metres
  kNumGaussianRows = 7,
};

/// K Gaussians, row by row: mean x, y, z, root sigma x, y, z, weight. This is what is stored, and
/// the meaning is GDF1's except that means are relative to the cube's minimum corner.
class Gaussians {
 public:
  Gaussians() = default;
  explicit Gaussians(std::size_t count) : values_(count * kNumGaussianRows), count_(count) {}

  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] float& at(std::size_t row, std::size_t k) { return values_[row * count_ + k]; }
  [[nodiscard]] float at(std::size_t row, std::size_t k) const { return values_[row * count_ + k]; }
  [[nodiscard]] std::span<const float> row(std::size_t row) const {
    return std::span(values_).subspan(row * count_, count_);
  }
  [[nodiscard]] std::span<float> row(std::size_t row) {
    return std::span(values_).subspan(row * count_, count_);
  }
  bool operator==(const Gaussians&) const = default;

 private:
  std::vector<float> values_;
  std::size_t count_ = 0;
};

/// A distance (metres) and its derivative with respect to position (no unit).
struct ValueGradient {
  double value = 0.0;
  Vector3 gradient = Vector3::Zero();
};

/// Gaussians made ready for evaluation: the rows of Gaussians with 1/s⁴ in place of s. Cubes of one
/// tile share arrays, so a row is found at `data + row * stride`. Does not own its data.
struct KernelView {
  const float* data = nullptr;
  std::size_t stride = 0;
  std::size_t count = 0;

  [[nodiscard]] const float* row(std::size_t r) const { return data + r * stride; }
};

/// Writes the kernel form of `gaussians` to columns [first, first + K) of seven rows `stride`
/// apart.
void write_kernel(const Gaussians& gaussians, float* data, std::size_t stride, std::size_t first);

/// Owns the kernel form of one cube.
class Kernel {
 public:
  explicit Kernel(const Gaussians& gaussians);
  [[nodiscard]] KernelView view() const { return {data_.data(), count_, count_}; }

 private:
  std::vector<float> data_;
  std::size_t count_;
};

/// The one kernel: d(p) = Σ w · exp(−½ Σ_a ((p_a − µ_a) / s_a²)²), in double precision from float
/// parameters (G-EDF, arXiv 2604.04525, with the variance s⁴ of its code). p is cube-local, metres.
[[nodiscard]] double evaluate(const KernelView& kernel, const Vector3& p_local);
[[nodiscard]] ValueGradient evaluate_with_gradient(const KernelView& kernel,
                                                   const Vector3& p_local);

}  // namespace gdfmap
