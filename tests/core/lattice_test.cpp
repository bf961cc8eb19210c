#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/lattice.hpp>

namespace gdfmap {
namespace {

TEST(Lattice, StepIsTheTileEdgeOver65536) {
  EXPECT_DOUBLE_EQ(Lattice(1.0).step(), 8.0 / 65536);
  EXPECT_DOUBLE_EQ(Lattice(4.0).step(), 32.0 / 65536);
}

TEST(Lattice, RoundsToTheNearestStep) {
  const Lattice lattice(1.0);
  const double s = lattice.step();
  EXPECT_EQ(lattice.quantize({0.4 * s, 0.6 * s, -0.6 * s}), (LatticePoint{0, 1, -1}));
}

TEST(Lattice, NoPointRoundsOutOfItsTile) {
  const Lattice lattice(1.0);
  // Just below a tile face: rounds up to the face, and belongs to the tile behind it.
  const LatticePoint p = *lattice.quantize({8.0 - 1e-9, -1e-9, 3.0});
  EXPECT_EQ(tile_of(p), (TileKey{0, 1, 0, 0}));
  const LatticePoint origin = tile_origin(tile_of(p));
  EXPECT_EQ(p.x - origin.x, 0);
}

TEST(Lattice, KeepsPositionsFarFromTheOrigin) {
  const Lattice lattice(1.0);
  const Vector3 p(637291.123456, 851210.654321, -511.000123);
  const Vector3 back = lattice.to_world(*lattice.quantize(p));
  EXPECT_LE((back - p).cwiseAbs().maxCoeff(), 0.5 * lattice.step() * (1 + 1e-6));
}

TEST(Lattice, RefusesWhatCannotBePlaced) {
  const Lattice lattice(1.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(lattice.quantize({nan, 0, 0}));
  EXPECT_FALSE(lattice.quantize({0, -inf, 0}));
  EXPECT_FALSE(lattice.quantize({0, 0, 1e12}));
  EXPECT_TRUE(lattice.quantize({1e7, -1e7, 1e7}));
  EXPECT_FALSE(lattice.cube_containing({0, nan, 0}, 0));
}

TEST(Lattice, RefusesACubeSizeThatIsNoLength) {
  EXPECT_THROW(Lattice(0.0), Error);
  EXPECT_THROW(Lattice(-1.0), Error);
  EXPECT_THROW(Lattice(std::nan("")), Error);
}

TEST(Lattice, TileAndIndexInvertCubeAt) {
  for (const TileKey tile : {TileKey{0, 0, 0, 0}, TileKey{0, -1, 5, -7}, TileKey{1, 3, -2, 0}}) {
    for (int index = 0; index < kCubesPerTile; ++index) {
      const CubeKey cube = cube_at(tile, index);
      EXPECT_EQ(tile_of(cube), tile);
      EXPECT_EQ(cube_index_in_tile(cube), index);
    }
  }
}

TEST(Lattice, CubesOfALevelAreFourTimesAsLong) {
  const Lattice lattice(0.5);
  EXPECT_DOUBLE_EQ(lattice.cube_edge(1), 2.0);
  EXPECT_DOUBLE_EQ(lattice.cube_edge(2), 8.0);
  EXPECT_EQ(lattice.cube_containing({-0.1, 1.9, 2.1}, 1), (CubeKey{1, -1, 0, 1}));
  const Box3 box = lattice.cube_box({1, -1, 0, 1});
  EXPECT_EQ(box.min(), Vector3(-2, 0, 2));
  EXPECT_EQ(box.max(), Vector3(0, 2, 4));
}

TEST(Lattice, TileBoxHoldsItsCubes) {
  const Lattice lattice(1.0);
  const Box3 box = lattice.tile_box({0, -1, 0, 2});
  EXPECT_EQ(box.min(), Vector3(-8, 0, 16));
  EXPECT_EQ(box.max(), Vector3(0, 8, 24));
}

}  // namespace
}  // namespace gdfmap
