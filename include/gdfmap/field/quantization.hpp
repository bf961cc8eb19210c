#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <gdfmap/field/gaussians.hpp>

namespace gdfmap {

/// How the Gaussians of a cube are stored.
enum class CubeCodec : std::uint8_t {
  kFloat32 = 0,    ///< 28 bytes a Gaussian, any values
  kQuantized = 1,  ///< 7 or 8 bytes a Gaussian, on a GaussianGrid
};

/// The grid of quantised Gaussians, in units of the cube's edge: means in [−1, 2] in equal steps,
/// standard deviations from 0.04 to 4 in equal ratios, weights in equal parts of ± the cube's
/// weight scale. Immutable and thread-safe.
class GaussianGrid {
 public:
  /// Of cubes that hold points, where shapes are sharp, and of those of which nobody knows: 9, 8
  /// and 13 bits for a mean, a standard deviation and a weight.
  [[nodiscard]] static const GaussianGrid& fine();
  /// Of cubes that hold no point: 8, 7 and 11 bits.
  [[nodiscard]] static const GaussianGrid& coarse();

  [[nodiscard]] int mean_bits() const { return mean_bits_; }
  [[nodiscard]] int sigma_bits() const { return sigma_bits_; }
  [[nodiscard]] int weight_bits() const { return weight_bits_; }
  /// All codes of a Gaussian fill whole bytes.
  [[nodiscard]] std::size_t num_bytes() const {
    return static_cast<std::size_t>(3 * (mean_bits_ + sigma_bits_) + weight_bits_) / 8;
  }

  /// Codes count from 0, those of weights from −max_weight_code(). The largest of a mean is a
  /// multiple of 6, so that the faces and the middle of the cube are on the grid.
  [[nodiscard]] int max_mean_code() const { return ((1 << mean_bits_) - 1) / 6 * 6; }
  [[nodiscard]] int max_sigma_code() const { return (1 << sigma_bits_) - 1; }
  [[nodiscard]] int max_weight_code() const { return (1 << (weight_bits_ - 1)) - 1; }

  /// The nearest mean of the grid, in edges; values beyond the grid go to its ends.
  [[nodiscard]] int mean_code(double mean) const;
  [[nodiscard]] double mean_of_code(int code) const;
  /// The nearest standard deviation in ratio, in edges.
  [[nodiscard]] int sigma_code(double sigma) const;
  [[nodiscard]] double sigma_of_code(int code) const;
  /// The nearest weight. @param scale  weight_scale() of the cube
  [[nodiscard]] int weight_code(float weight, float scale) const;
  [[nodiscard]] float weight_of_code(int code, float scale) const;

  /// Metres, the unit of a cube's weights: the largest magnitude rounded up to 9 significant bits,
  /// or the number of 9 bits below it where the largest weight's code stands for no more than that.
  /// 0 below kLeastWeightScale, for weights that are all zero then.
  [[nodiscard]] float weight_scale(const Gaussians& gaussians) const;
  /// Rounds weights to the grid of their scale, which is the same afterwards; all stay as they are
  /// when one is not finite.
  void quantize_weights(Gaussians& gaussians) const;

 private:
  /// @param sigma_ratio  100 to the power of 1 / (number of sigma codes − 1)
  GaussianGrid(int mean_bits, int sigma_bits, int weight_bits, double sigma_ratio);

  int mean_bits_, sigma_bits_, weight_bits_;
  std::vector<double> sigmas_;  ///< of each code
};

/// That of a cube by its class.
/// @param is_empty  known to hold no point
[[nodiscard]] inline const GaussianGrid& gaussian_grid(bool is_empty) {
  return is_empty ? GaussianGrid::coarse() : GaussianGrid::fine();
}

inline constexpr float kLeastWeightScale = 1e-30f;

/// What is stored for a mean and a standard deviation, metres and √m.
[[nodiscard]] float stored_mean(double mean_in_edges, double edge);
[[nodiscard]] float stored_root_sigma(double sigma_in_edges, double edge);

/// Errors and reach of quantised cubes in 8 bits: 0, 253 lengths from 1/4096 of an edge upwards in
/// ratios of 2^(1/16), infinity for what is longer, and not-a-number.
class LengthGrid {
 public:
  /// @param edge  of a cube, metres
  explicit LengthGrid(double edge);

  /// The nearest length, metres: an estimate. @param length  not negative, or not-a-number
  [[nodiscard]] std::uint8_t nearest(float length) const;
  /// The least length that is not below: a bound.
  [[nodiscard]] std::uint8_t not_below(float length) const;
  [[nodiscard]] float of_code(std::uint8_t code) const { return lengths_[code]; }

 private:
  std::array<float, 256> lengths_;
};

}  // namespace gdfmap
