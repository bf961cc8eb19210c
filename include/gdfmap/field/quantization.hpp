#pragma once

#include <cstdint>

#include <gdfmap/field/gaussians.hpp>

namespace gdfmap {

/// How the Gaussians of a cube are stored.
enum class CubeCodec : std::uint8_t {
  kFloat32 = 0,    ///< 28 bytes a Gaussian, any values
  kQuantized = 1,  ///< 8 bytes a Gaussian, on the grid below
};

/// The grid of quantised Gaussians, in units of the cube's edge: means in [−1, 2] in 511 equal
/// steps (9 bits), standard deviations from 0.04 to 4 in 255 equal ratios (8 bits), weights in
/// ±4095ths (13 bits) of the cube's largest one.
inline constexpr int kMaxMeanCode = 511;
inline constexpr int kMaxSigmaCode = 255;
inline constexpr int kMaxWeightCode = 4095;
/// Metres; a cube without a weight so large has none but zeros.
inline constexpr float kLeastLargestWeight = 1e-30f;

/// The nearest mean of the grid, in edges; values beyond the grid go to its ends.
[[nodiscard]] int mean_code(double mean);
[[nodiscard]] double mean_of_code(int code);

/// The nearest standard deviation, in edges.
[[nodiscard]] int sigma_code(double sigma);
[[nodiscard]] double sigma_of_code(int code);

/// The nearest weight. @param largest  magnitude of the cube's largest weight, metres
[[nodiscard]] int weight_code(float weight, float largest);
[[nodiscard]] float weight_of_code(int code, float largest);

/// What is stored for a mean and a standard deviation, metres and √m.
[[nodiscard]] float stored_mean(double mean_in_edges, double edge);
[[nodiscard]] float stored_root_sigma(double sigma_in_edges, double edge);

/// Magnitude of the largest weight, metres; 0 below kLeastLargestWeight.
[[nodiscard]] float largest_weight(const Gaussians& gaussians);
/// Rounds weights, metres, to the grid of the largest of them; all stay as they are when one is not
/// finite.
void quantize_weights(Gaussians& gaussians);

/// The least float of 8 significant bits that is not below a value ≥ 0; NaN stays NaN.
[[nodiscard]] float round_up_to_8_bits(float value);

}  // namespace gdfmap
