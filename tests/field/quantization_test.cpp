#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/field/quantization.hpp>

namespace gdfmap {
namespace {

class GaussianGrids : public testing::TestWithParam<const GaussianGrid*> {
 protected:
  const GaussianGrid& grid_ = *GetParam();
};

TEST_P(GaussianGrids, EveryCodeReadsBack) {
  for (int code = 0; code <= grid_.max_mean_code(); ++code) {
    EXPECT_EQ(grid_.mean_code(grid_.mean_of_code(code)), code);
  }
  for (int code = 0; code <= grid_.max_sigma_code(); ++code) {
    EXPECT_EQ(grid_.sigma_code(grid_.sigma_of_code(code)), code);
  }
  for (int code = -grid_.max_weight_code(); code <= grid_.max_weight_code(); ++code) {
    EXPECT_EQ(grid_.weight_code(grid_.weight_of_code(code, 0.37f), 0.37f), code);
  }
}

/// Also through the floats that are stored, whatever the edge.
TEST_P(GaussianGrids, EveryCodeReadsBackFromWhatIsStored) {
  for (const double edge : {0.1, 1.0, 3.7, 16.0, 1234.5}) {
    for (int code = 0; code <= grid_.max_mean_code(); ++code) {
      EXPECT_EQ(grid_.mean_code(stored_mean(grid_.mean_of_code(code), edge) / edge), code);
    }
    for (int code = 0; code <= grid_.max_sigma_code(); ++code) {
      const double root_sigma = stored_root_sigma(grid_.sigma_of_code(code), edge);
      EXPECT_EQ(grid_.sigma_code(root_sigma * root_sigma / edge), code);
    }
  }
}

TEST_P(GaussianGrids, EndWhereTheFitsBoundsDo) {
  EXPECT_EQ(grid_.mean_of_code(0), -1.0);
  EXPECT_EQ(grid_.mean_of_code(grid_.max_mean_code()), 2.0);
  for (const double place : {0.0, 0.5, 1.0}) {  // the cube's faces and its middle
    EXPECT_NEAR(grid_.mean_of_code(grid_.mean_code(place)), place, 1e-15);
  }
  EXPECT_EQ(grid_.sigma_of_code(0), 0.04);
  EXPECT_NEAR(grid_.sigma_of_code(grid_.max_sigma_code()), 4.0, 1e-12);
  EXPECT_EQ(grid_.mean_code(-7.0), 0);
  EXPECT_EQ(grid_.mean_code(7.0), grid_.max_mean_code());
  EXPECT_EQ(grid_.sigma_code(1e-9), 0);
  EXPECT_EQ(grid_.sigma_code(1e9), grid_.max_sigma_code());
}

TEST_P(GaussianGrids, TakeTheNearest) {
  for (double mean = -1.0; mean <= 2.0; mean += 0.00077) {
    const double rounded = grid_.mean_of_code(grid_.mean_code(mean));
    EXPECT_LE(std::abs(rounded - mean), 0.5 * 3.0 / grid_.max_mean_code() + 1e-12);
  }
  for (double log_sigma = std::log(0.04); log_sigma < std::log(4.0); log_sigma += 0.0013) {
    const double rounded = std::log(grid_.sigma_of_code(grid_.sigma_code(std::exp(log_sigma))));
    EXPECT_LE(std::abs(rounded - log_sigma), 0.5 * std::log(100.0) / grid_.max_sigma_code() + 1e-9);
  }
}

Gaussians with_weights(std::initializer_list<float> weights) {
  Gaussians gaussians(weights.size());
  std::ranges::copy(weights, gaussians.row(kWeight).begin());
  return gaussians;
}

TEST_P(GaussianGrids, WeightsKeepToHalfAStepOfTheirScale) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-3.0f, 3.0f);
  for (int round = 0; round < 20000; ++round) {
    Gaussians gaussians = with_weights({uniform(random), uniform(random), 0.1f * uniform(random)});
    const Gaussians before = gaussians;
    const float scale = grid_.weight_scale(gaussians);
    grid_.quantize_weights(gaussians);
    for (std::size_t k = 0; k < before.size(); ++k) {
      EXPECT_LE(std::abs(gaussians.at(kWeight, k) - before.at(kWeight, k)),
                0.50001f * scale / static_cast<float>(grid_.max_weight_code()));
    }
    EXPECT_EQ(grid_.weight_scale(gaussians), scale);
    const Gaussians once = gaussians;
    grid_.quantize_weights(gaussians);
    EXPECT_EQ(gaussians, once);
  }
}

/// The numbers that are just above one of 9 bits would be rounded down to it.
TEST_P(GaussianGrids, AScaleIsThatOfTheWeightsThatItGives) {
  for (float weight : {1.0f, 1.99609375f, 0.50390625f, 2.0e-30f}) {
    for (int step = 0; step < 2000; ++step, weight = std::nextafter(weight, 2.0f * weight)) {
      Gaussians gaussians = with_weights({weight});
      const float scale = grid_.weight_scale(gaussians);
      grid_.quantize_weights(gaussians);
      ASSERT_EQ(grid_.weight_scale(gaussians), scale) << weight;
      ASSERT_NEAR(gaussians.at(kWeight, 0), weight, 5e-4f * weight);
    }
  }
}

TEST_P(GaussianGrids, TinyWeightsAreZeros) {
  Gaussians gaussians = with_weights({1e-31f, -1e-32f});
  EXPECT_EQ(grid_.weight_scale(gaussians), 0.0f);
  grid_.quantize_weights(gaussians);
  EXPECT_EQ(gaussians, with_weights({0.0f, 0.0f}));
}

TEST_P(GaussianGrids, WeightsThatAreNoNumbersStay) {
  Gaussians gaussians = with_weights({std::numeric_limits<float>::quiet_NaN(), 0.123456f});
  grid_.quantize_weights(gaussians);
  EXPECT_TRUE(std::isnan(gaussians.at(kWeight, 0)));
  EXPECT_EQ(gaussians.at(kWeight, 1), 0.123456f);
}

INSTANTIATE_TEST_SUITE_P(, GaussianGrids,
                         testing::Values(&GaussianGrid::fine(), &GaussianGrid::coarse()),
                         [](const auto& grid) { return grid.index == 0 ? "Fine" : "Coarse"; });

TEST(LengthGrid, EveryCodeReadsBack) {
  for (const double edge : {1e-6, 0.37, 1.0, 16.0, 1e9}) {
    const LengthGrid grid(edge);
    for (int code = 0; code <= 255; ++code) {
      const auto byte = static_cast<std::uint8_t>(code);
      EXPECT_EQ(grid.nearest(grid.of_code(byte)), byte);
      EXPECT_EQ(grid.not_below(grid.of_code(byte)), byte);
    }
  }
}

TEST(LengthGrid, TakesTheNearestOrABound) {
  const LengthGrid grid(1.0);
  EXPECT_EQ(grid.of_code(0), 0.0f);
  EXPECT_EQ(grid.of_code(1), 1.0f / 4096.0f);
  EXPECT_NEAR(grid.of_code(17), 1.0f / 2048.0f, 1e-9f);
  EXPECT_EQ(grid.nearest(1e-4f), 0);
  EXPECT_EQ(grid.not_below(1e-4f), 1);
  for (float length = 3e-4f; length < 13.0f; length *= 1.0037f) {
    const float nearest = grid.of_code(grid.nearest(length));
    EXPECT_LE(std::abs(nearest - length), 0.023f * length);
    const float bound = grid.of_code(grid.not_below(length));
    EXPECT_GE(bound, length);
    EXPECT_LE(bound, 1.0443f * length);
  }
}

TEST(LengthGrid, KnowsInfinityAndNoNumber) {
  const LengthGrid grid(1.0);
  EXPECT_TRUE(std::isinf(grid.of_code(grid.nearest(100.0f))));
  EXPECT_TRUE(std::isinf(grid.of_code(grid.not_below(HUGE_VALF))));
  EXPECT_TRUE(std::isnan(grid.of_code(grid.nearest(std::nanf("")))));
}

}  // namespace
}  // namespace gdfmap
