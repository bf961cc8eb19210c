#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <gdfmap/field/quantization.hpp>

namespace gdfmap {
namespace {

TEST(Quantization, EveryCodeReadsBack) {
  for (int code = 0; code <= kMaxMeanCode; ++code) EXPECT_EQ(mean_code(mean_of_code(code)), code);
  for (int code = 0; code <= kMaxSigmaCode; ++code)
    EXPECT_EQ(sigma_code(sigma_of_code(code)), code);
  for (int code = -kMaxWeightCode; code <= kMaxWeightCode; ++code) {
    EXPECT_EQ(weight_code(weight_of_code(code, 0.37f), 0.37f), code);
  }
}

/// Also through the floats that are stored, whatever the edge.
TEST(Quantization, EveryCodeReadsBackFromWhatIsStored) {
  for (const double edge : {0.1, 1.0, 3.7, 16.0, 1234.5}) {
    for (int code = 0; code <= kMaxMeanCode; ++code) {
      EXPECT_EQ(mean_code(stored_mean(mean_of_code(code), edge) / edge), code);
    }
    for (int code = 0; code <= kMaxSigmaCode; ++code) {
      const double root_sigma = stored_root_sigma(sigma_of_code(code), edge);
      EXPECT_EQ(sigma_code(root_sigma * root_sigma / edge), code);
    }
  }
}

TEST(Quantization, GridEndsWhereTheFitsBoundsDo) {
  EXPECT_EQ(mean_of_code(0), -1.0);
  EXPECT_EQ(mean_of_code(kMaxMeanCode), 2.0);
  EXPECT_EQ(sigma_of_code(0), 0.04);
  EXPECT_NEAR(sigma_of_code(kMaxSigmaCode), 4.0, 1e-12);
  EXPECT_EQ(mean_code(-7.0), 0);
  EXPECT_EQ(mean_code(7.0), kMaxMeanCode);
  EXPECT_EQ(sigma_code(1e-9), 0);
  EXPECT_EQ(sigma_code(1e9), kMaxSigmaCode);
}

TEST(Quantization, TakesTheNearest) {
  for (double mean = -1.0; mean <= 2.0; mean += 0.00077) {
    EXPECT_LE(std::abs(mean_of_code(mean_code(mean)) - mean), 0.5 * 3.0 / kMaxMeanCode + 1e-12);
  }
  for (double log_sigma = std::log(0.04); log_sigma < std::log(4.0); log_sigma += 0.0013) {
    const double rounded = std::log(sigma_of_code(sigma_code(std::exp(log_sigma))));
    EXPECT_LE(std::abs(rounded - log_sigma), 0.5 * std::log(100.0) / kMaxSigmaCode + 1e-9);
  }
}

TEST(Quantization, WeightsKeepTheLargest) {
  Gaussians gaussians(3);
  gaussians.at(kWeight, 0) = 0.1f;
  gaussians.at(kWeight, 1) = -2.7f;
  gaussians.at(kWeight, 2) = 1e-5f;
  quantize_weights(gaussians);
  EXPECT_EQ(gaussians.at(kWeight, 1), -2.7f);
  EXPECT_NEAR(gaussians.at(kWeight, 0), 0.1f, 0.5f * 2.7f / kMaxWeightCode);
  EXPECT_EQ(gaussians.at(kWeight, 2), 0.0f);
  const Gaussians once = gaussians;
  quantize_weights(gaussians);
  EXPECT_EQ(gaussians, once);
}

TEST(Quantization, WeightsThatAreNoNumbersStay) {
  Gaussians gaussians(2);
  gaussians.at(kWeight, 0) = std::numeric_limits<float>::quiet_NaN();
  gaussians.at(kWeight, 1) = 0.123456f;
  quantize_weights(gaussians);
  EXPECT_TRUE(std::isnan(gaussians.at(kWeight, 0)));
  EXPECT_EQ(gaussians.at(kWeight, 1), 0.123456f);
}

TEST(RoundUpTo8Bits, IsTheNextOneAndNeverBelow) {
  EXPECT_EQ(round_up_to_8_bits(1.0f), 1.0f);
  EXPECT_EQ(round_up_to_8_bits(0.0f), 0.0f);
  EXPECT_EQ(round_up_to_8_bits(1.0001f), 1.0078125f);
  EXPECT_TRUE(std::isnan(round_up_to_8_bits(std::nanf(""))));
  for (float v = 1e-6f; v < 10.0f; v *= 1.37f) {
    const float rounded = round_up_to_8_bits(v);
    EXPECT_GE(rounded, v);
    EXPECT_LE(rounded, v * (1.0f + 1.0f / 128));
    EXPECT_EQ(round_up_to_8_bits(rounded), rounded);
  }
}

}  // namespace
}  // namespace gdfmap
