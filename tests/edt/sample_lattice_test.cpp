#include <cmath>

#include <gtest/gtest.h>

#include <gdfmap/edt/sample_lattice.hpp>

namespace gdfmap {
namespace {

TEST(TrainingGrid, NeighbouringCubesShareSamples) {
  for (const TrainingGrid& grid : kTrainingGrids) {
    for (int level = 0; level < kMaxLevels; ++level) {
      for (int i = 0; i < 2 * grid.margin; ++i) {
        EXPECT_EQ(grid.offset(grid.per_edge + i, level),
                  grid.offset(i, level) + steps_per_cube(level));
      }
    }
  }
}

TEST(TrainingGrid, IsRegularAndCentredOnTheCube) {
  EXPECT_DOUBLE_EQ(kEmptyGrid.position(0), -3.0 / 16);
  EXPECT_DOUBLE_EQ(kEmptyGrid.position(kEmptyGrid.margin), 1.0 / 16);
  EXPECT_DOUBLE_EQ(kEmptyGrid.position(kEmptyGrid.per_axis() - 1), 1.0 + 3.0 / 16);
  constexpr double kRounding = 1.0 / kStepsPerCubeAxis;
  for (const TrainingGrid& grid : kTrainingGrids) {
    for (int i = 0; i < grid.per_axis(); ++i) {
      EXPECT_NEAR(grid.position(i), (i - grid.margin + 0.5) / grid.per_edge, kRounding);
    }
  }
}

TEST(HeldOutSamples, LieWithinTheCubeAndOffTheTrainingSamples) {
  for (const TrainingGrid& grid : kTrainingGrids) {
    for (int i = 0; i < grid.held_out; ++i) {
      const double x = grid.held_out_position(i, 0);
      EXPECT_NEAR(x, (i + 0.5) / grid.held_out, 1.0 / kStepsPerCubeAxis);
      for (int j = 0; j < grid.per_axis(); ++j) EXPECT_GT(std::abs(x - grid.position(j)), 0.01);
    }
  }
}

}  // namespace
}  // namespace gdfmap
