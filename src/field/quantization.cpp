#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include <gdfmap/field/quantization.hpp>

namespace gdfmap {
namespace {

constexpr double kLeastMean = -1.0, kMeanRange = 3.0;
constexpr double kLeastSigma = 0.04;
/// 100^(1/255): from 0.04 to 4 in 255 steps. The grid is made of products alone, so that it is the
/// same whatever the mathematical library.
constexpr double kSigmaRatio = 1.0182235496492733;

/// The smallest of the grid first.
const std::array<double, kMaxSigmaCode + 1>& sigma_grid() {
  static const auto grid = [] {
    std::array<double, kMaxSigmaCode + 1> result;
    double sigma = kLeastSigma;
    for (double& value : result) {
      value = sigma;
      sigma *= kSigmaRatio;
    }
    return result;
  }();
  return grid;
}

}  // namespace

int mean_code(double mean) {
  const double code = std::round((mean - kLeastMean) / kMeanRange * kMaxMeanCode);
  return static_cast<int>(std::clamp(code, 0.0, static_cast<double>(kMaxMeanCode)));
}

double mean_of_code(int code) { return kLeastMean + kMeanRange * code / kMaxMeanCode; }

int sigma_code(double sigma) {
  const auto& grid = sigma_grid();
  const auto above = std::lower_bound(grid.begin(), grid.end(), sigma);
  if (above == grid.begin()) return 0;
  if (above == grid.end()) return kMaxSigmaCode;
  const auto place = static_cast<int>(above - grid.begin());
  return sigma * sigma < *above * *(above - 1) ? place - 1 : place;  // nearest in ratio
}

double sigma_of_code(int code) { return sigma_grid()[static_cast<std::size_t>(code)]; }

int weight_code(float weight, float largest) {
  if (!(largest > 0.0f)) return 0;
  const double code =
      std::round(static_cast<double>(weight) / static_cast<double>(largest) * kMaxWeightCode);
  return static_cast<int>(
      std::clamp(code, -static_cast<double>(kMaxWeightCode), static_cast<double>(kMaxWeightCode)));
}

float weight_of_code(int code, float largest) {
  return static_cast<float>(static_cast<double>(largest) * code / kMaxWeightCode);
}

float stored_mean(double mean_in_edges, double edge) {
  return static_cast<float>(mean_in_edges * edge);
}

float stored_root_sigma(double sigma_in_edges, double edge) {
  return static_cast<float>(std::sqrt(sigma_in_edges * edge));
}

float largest_weight(const Gaussians& gaussians) {
  float largest = 0.0f;
  for (const float w : gaussians.row(kWeight)) largest = std::max(largest, std::abs(w));
  return largest >= kLeastLargestWeight ? largest : 0.0f;
}

void quantize_weights(Gaussians& gaussians) {
  const auto weights = gaussians.row(kWeight);
  if (!std::all_of(weights.begin(), weights.end(), [](float w) { return std::isfinite(w); }))
    return;
  const float largest = largest_weight(gaussians);
  for (float& w : weights) w = weight_of_code(weight_code(w, largest), largest);
}

float round_up_to_8_bits(float value) {
  if (!std::isfinite(value)) return value;
  const auto bits = std::bit_cast<std::uint32_t>(value);
  return std::bit_cast<float>((bits + 0xffffu) & 0xffff0000u);
}

}  // namespace gdfmap
