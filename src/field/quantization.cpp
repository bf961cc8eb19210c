#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <gdfmap/field/quantization.hpp>

namespace gdfmap {
namespace {

constexpr double kLeastMean = -1.0, kMeanRange = 3.0;
constexpr double kLeastSigma = 0.04;
/// From 0.04 to 4 in 255 and in 127 steps. Grids are made of products alone, so that they are the
/// same whatever the mathematical library.
constexpr double kFineSigmaRatio = 1.0182235496492733, kCoarseSigmaRatio = 1.0369266382873439;

/// In edges; and 2^(1/16).
constexpr double kLeastLength = 1.0 / 4096.0, kLengthRatio = 1.0442737824274138;
constexpr std::uint8_t kInfiniteLength = 254, kUnknownLength = 255;

/// A float of 9 significant bits keeps its exponent and the first 8 bits behind it.
constexpr std::uint32_t kDroppedBits = (1u << 15) - 1;

float round_up_to_9_bits(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  return std::bit_cast<float>((bits + kDroppedBits) & ~kDroppedBits);
}

float number_of_9_bits_below(float value) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(value) - (kDroppedBits + 1));
}

}  // namespace

GaussianGrid::GaussianGrid(int mean_bits, int sigma_bits, int weight_bits, double sigma_ratio)
    : mean_bits_(mean_bits), sigma_bits_(sigma_bits), weight_bits_(weight_bits) {
  for (double sigma = kLeastSigma; sigmas_.size() < std::size_t{1} << sigma_bits;
       sigma *= sigma_ratio) {
    sigmas_.push_back(sigma);
  }
}

const GaussianGrid& GaussianGrid::fine() {
  static const GaussianGrid grid(9, 8, 13, kFineSigmaRatio);
  return grid;
}

const GaussianGrid& GaussianGrid::coarse() {
  static const GaussianGrid grid(8, 7, 11, kCoarseSigmaRatio);
  return grid;
}

int GaussianGrid::mean_code(double mean) const {
  const double code = std::round((mean - kLeastMean) / kMeanRange * max_mean_code());
  return static_cast<int>(std::clamp(code, 0.0, static_cast<double>(max_mean_code())));
}

double GaussianGrid::mean_of_code(int code) const {
  return kLeastMean + kMeanRange * code / max_mean_code();
}

int GaussianGrid::sigma_code(double sigma) const {
  const auto above = std::ranges::lower_bound(sigmas_, sigma);
  if (above == sigmas_.begin()) return 0;
  if (above == sigmas_.end()) return max_sigma_code();
  const auto place = static_cast<int>(above - sigmas_.begin());
  return sigma * sigma < *above * *(above - 1) ? place - 1 : place;
}

double GaussianGrid::sigma_of_code(int code) const {
  return sigmas_[static_cast<std::size_t>(code)];
}

int GaussianGrid::weight_code(float weight, float scale) const {
  if (!(scale > 0.0f && std::isfinite(scale))) return 0;
  const double most = max_weight_code();
  const double code = std::round(static_cast<double>(weight) / static_cast<double>(scale) * most);
  return static_cast<int>(std::clamp(code, -most, most));
}

float GaussianGrid::weight_of_code(int code, float scale) const {
  return static_cast<float>(static_cast<double>(scale) * code / max_weight_code());
}

float GaussianGrid::weight_scale(const Gaussians& gaussians) const {
  float largest = 0.0f;
  for (const float w : gaussians.row(kWeight)) largest = std::max(largest, std::abs(w));
  if (!(largest >= kLeastWeightScale)) return 0.0f;
  const float above = round_up_to_9_bits(largest), below = number_of_9_bits_below(above);
  const float scale = weight_of_code(weight_code(largest, above), above) > below ? above : below;
  return scale >= kLeastWeightScale ? scale : 0.0f;
}

void GaussianGrid::quantize_weights(Gaussians& gaussians) const {
  const auto weights = gaussians.row(kWeight);
  if (!std::ranges::all_of(weights, [](float w) { return std::isfinite(w); })) return;
  const float scale = weight_scale(gaussians);
  for (float& w : weights) w = weight_of_code(weight_code(w, scale), scale);
}

float stored_mean(double mean_in_edges, double edge) {
  return static_cast<float>(mean_in_edges * edge);
}

float stored_root_sigma(double sigma_in_edges, double edge) {
  return static_cast<float>(std::sqrt(sigma_in_edges * edge));
}

LengthGrid::LengthGrid(double edge) {
  lengths_[0] = 0.0f;
  double length = kLeastLength * edge;
  for (std::uint8_t code = 1; code < kInfiniteLength; ++code, length *= kLengthRatio) {
    lengths_[code] = static_cast<float>(length);
  }
  lengths_[kInfiniteLength] = std::numeric_limits<float>::infinity();
  lengths_[kUnknownLength] = std::numeric_limits<float>::quiet_NaN();
}

std::uint8_t LengthGrid::not_below(float length) const {
  if (std::isnan(length)) return kUnknownLength;
  const auto end = lengths_.begin() + kInfiniteLength;
  return static_cast<std::uint8_t>(std::lower_bound(lengths_.begin(), end, length) -
                                   lengths_.begin());
}

std::uint8_t LengthGrid::nearest(float length) const {
  const std::uint8_t above = not_below(length);
  if (above == 0 || above >= kInfiniteLength) return above;
  const auto below = static_cast<std::uint8_t>(above - 1);
  return length - lengths_[below] < lengths_[above] - length ? below : above;
}

}  // namespace gdfmap
