#include "pipeline/surface/surface_kernels.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/core/flush_to_zero.hpp>

#include "pipeline/surface/neighbourhood.hpp"

namespace gdfmap::surface {
namespace {

constexpr std::size_t kSide = 21;  // no multiple of any register's width

/// A cube with any Gaussians, as a surface is made of.
class SurfaceKernelsTest : public testing::Test {
 protected:
  SurfaceKernelsTest() {
    std::mt19937 generator(5);
    const auto uniform = [&](float low, float high) {
      return std::uniform_real_distribution<float>(low, high)(generator);
    };
    Gaussians gaussians(19);
    for (std::size_t k = 0; k < gaussians.size(); ++k) {
      for (std::size_t row = 0; row < 3; ++row) {
        gaussians.at(kMeanX + row, k) = uniform(-0.5f, 1.5f);
        gaussians.at(kRootSigmaX + row, k) = uniform(0.25f, 1.2f);
      }
      gaussians.at(kWeight, k) = uniform(-1.0f, 1.0f);
    }
    kernel_.emplace(gaussians);
    rows_ = buffer_.fill(kernel_->view());
    position_.resize(kSide);
    share_.resize(kSide);
    for (std::size_t i = 0; i < padded(kSide); ++i) {
      position_.data()[i] = 0.05f * static_cast<float>(i);
      share_.data()[i] = i < kSide ? 0.5f + 0.02f * static_cast<float>(i) : 0.0f;
    }
  }

  /// The cube's share of a block, [z][y][x].
  std::vector<float> block(InstructionSet set) {
    const FlushToZero flush;
    const SurfaceKernels& kernels = surface_kernels(set);
    const std::size_t width = padded(kSide);
    AlignedFloats x, y, z, products, values;
    x.resize(rows_.count * width);
    y.resize(kSide * rows_.stride);
    z.resize(kSide * rows_.stride);
    products.resize(rows_.stride);
    values.resize(kSide * kSide * width);
    std::fill_n(values.data(), kSide * kSide * width, 0.0f);
    for (std::size_t k = 0; k < rows_.count; ++k) {
      kernels.factors_of_gaussian(position_.data(), share_.data(), width, rows_.mean[0][k],
                                  rows_.inverse[0][k], x.data() + k * width);
    }
    for (std::size_t i = 0; i < kSide; ++i) {
      kernels.factors_of_sample(position_.data()[i], share_.data()[i], rows_.mean[1],
                                rows_.inverse[1], nullptr, rows_.stride,
                                y.data() + i * rows_.stride);
      kernels.factors_of_sample(position_.data()[i], share_.data()[i], rows_.mean[2],
                                rows_.inverse[2], rows_.weight, rows_.stride,
                                z.data() + i * rows_.stride);
    }
    kernels.add_block({rows_.count, x.data(), width, y.data(), z.data(), rows_.stride, 0, width, 0,
                       kSide, 0, kSide, products.data(), values.data(), width, width * kSide});
    return {values.data(), values.data() + kSide * kSide * width};
  }

  /// Value, then gradient, at kSide points on a diagonal.
  std::vector<float> points(InstructionSet set) {
    const FlushToZero flush;
    AlignedFloats results[4];
    for (AlignedFloats& result : results) result.resize(kSide);
    surface_kernels(set).values_and_gradients(
        rows_, {padded(kSide),
                {position_.data(), position_.data(), position_.data()},
                results[0].data(),
                {results[1].data(), results[2].data(), results[3].data()}});
    std::vector<float> all;
    for (const AlignedFloats& result : results) {
      all.insert(all.end(), result.data(), result.data() + kSide);
    }
    return all;
  }

  std::optional<Kernel> kernel_;
  GaussianRowsBuffer buffer_;
  GaussianRows rows_{};
  AlignedFloats position_, share_;
};

TEST_F(SurfaceKernelsTest, ABlockIsTheSumOfItsGaussians) {
  const std::vector<float> values = block(best_instruction_set());
  for (std::size_t z = 0; z < kSide; ++z) {
    for (std::size_t y = 0; y < kSide; ++y) {
      for (std::size_t x = 0; x < kSide; ++x) {
        const auto at = [&](std::size_t i) { return static_cast<double>(position_.data()[i]); };
        const auto share = [&](std::size_t i) { return static_cast<double>(share_.data()[i]); };
        const double expected =
            evaluate(kernel_->view(), {at(x), at(y), at(z)}) * share(x) * share(y) * share(z);
        EXPECT_NEAR(values[(z * kSide + y) * padded(kSide) + x], expected, 3e-6);
      }
    }
  }
}

TEST_F(SurfaceKernelsTest, PointsHaveValueAndGradient) {
  const std::vector<float> results = points(best_instruction_set());
  for (std::size_t i = 0; i < kSide; ++i) {
    const double p = static_cast<double>(position_.data()[i]);
    const ValueGradient expected = evaluate_with_gradient(kernel_->view(), {p, p, p});
    EXPECT_NEAR(results[i], expected.value, 3e-6);
    for (std::size_t a = 0; a < 3; ++a) {
      EXPECT_NEAR(results[(a + 1) * kSide + i], expected.gradient[static_cast<int>(a)], 1e-4);
    }
  }
}

TEST_F(SurfaceKernelsTest, HaveTheSameBitsOnEveryInstructionSet) {
  const std::vector<float> expected_block = block(InstructionSet::kPortable);
  const std::vector<float> expected_points = points(InstructionSet::kPortable);
  for (const auto set : {InstructionSet::kAvx2, InstructionSet::kAvx512}) {
    if (!is_supported(set)) continue;
    EXPECT_TRUE(block(set) == expected_block) << name_of(set);
    EXPECT_TRUE(points(set) == expected_points) << name_of(set);
  }
}

}  // namespace
}  // namespace gdfmap::surface
