#include <cmath>

#include <gtest/gtest.h>

#include <gdfmap/edt/sample_lattice.hpp>

namespace gdfmap {
namespace {

TEST(SampleLattice, NeighbouringCubesShareSamples) {
  for (int level = 0; level < kMaxLevels; ++level) {
    for (int i = 0; i < 2 * kMarginSamples; ++i) {
      EXPECT_EQ(sample_offset(kSamplesPerEdge + i, level),
                sample_offset(i, level) + steps_per_cube(level));
    }
  }
}

TEST(SampleLattice, CoversCubeAndMargin) {
  EXPECT_DOUBLE_EQ(sample_position(0), -3.0 / 16);
  EXPECT_DOUBLE_EQ(sample_position(kMarginSamples), 1.0 / 16);
  EXPECT_DOUBLE_EQ(sample_position(kSamplesPerAxis - 1), 1.0 + 3.0 / 16);
}

TEST(SampleLattice, HeldOutSamplesLieWithinTheCubeAndOffTheTrainingSamples) {
  for (int i = 0; i < kHeldOutPerAxis; ++i) {
    const double x = held_out_position(i, 0);
    EXPECT_NEAR(x, (i + 0.5) / kHeldOutPerAxis, 1.0 / kStepsPerCubeAxis);
    for (int j = 0; j < kSamplesPerAxis; ++j) EXPECT_GT(std::abs(x - sample_position(j)), 0.01);
  }
}

}  // namespace
}  // namespace gdfmap
