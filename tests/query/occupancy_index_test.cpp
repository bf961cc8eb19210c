#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/query/occupancy_index.hpp>

namespace gdfmap {
namespace {

double brute_force(const std::vector<OccupiedTile>& tiles, double cube_size, const Vector3& p) {
  const Lattice lattice(cube_size);
  double best = std::numeric_limits<double>::infinity();
  for (const OccupiedTile& tile : tiles) {
    for (int i = 0; i < kCubesPerTile; ++i) {
      if (!tile.cubes.test(i)) continue;
      best = std::min(best, lattice.cube_box(cube_at(tile.key, i)).exteriorDistance(p));
    }
  }
  return best;
}

std::vector<OccupiedTile> random_tiles(int count, int extent, std::mt19937& random) {
  std::vector<OccupiedTile> tiles;
  const auto coordinate = [&] {
    return static_cast<std::int32_t>(random() % static_cast<unsigned>(2 * extent)) - extent;
  };
  while (static_cast<int>(tiles.size()) < count) {
    OccupiedTile tile{{0, coordinate(), coordinate(), coordinate()}, {}};
    const auto same = [&](const OccupiedTile& other) { return other.key == tile.key; };
    if (std::ranges::any_of(tiles, same)) continue;
    for (std::uint32_t i = 0; i < 1 + random() % 9; ++i) tile.cubes.set(int(random() % 512));
    tiles.push_back(tile);
  }
  return tiles;
}

TEST(OccupancyIndex, FindsTheDistanceThatBruteForceFinds) {
  std::mt19937 random(3);
  for (const double cube_size : {1.0, 0.3}) {
    const std::vector<OccupiedTile> tiles = random_tiles(200, 8, random);
    const OccupancyIndex index(tiles, cube_size);
    std::uniform_real_distribution<double> uniform(-100.0 * cube_size, 100.0 * cube_size);
    for (int i = 0; i < 500; ++i) {
      const Vector3 p(uniform(random), uniform(random), uniform(random));
      const FarBound far = index.nearest(p).value();
      const double expected = brute_force(tiles, cube_size, p);
      EXPECT_NEAR(far.distance, expected, 1e-12 * (1.0 + expected));
      EXPECT_NEAR(far.gradient.norm(), expected > 0.0 ? 1.0 : 0.0, 1e-12);
      // One step back along the gradient is the nearest point of a cube.
      EXPECT_NEAR(brute_force(tiles, cube_size, p - far.distance * far.gradient), 0.0, 1e-9);
    }
  }
}

TEST(OccupancyIndex, IsZeroWithoutDirectionInsideAndOnACube) {
  OccupiedTile tile{{0, -1, 0, 0}, {}};
  tile.cubes.set(0);  // the cube from (-8, 0, 0) to (-7, 1, 1)
  const OccupancyIndex index({tile}, 1.0);
  for (const Vector3& p : {Vector3(-7.5, 0.5, 0.5), Vector3(-8, 0, 0), Vector3(-7, 1, 0.5)}) {
    EXPECT_EQ(index.nearest(p).value().distance, 0.0);
    EXPECT_EQ(index.nearest(p).value().gradient, Vector3::Zero());
  }
  const FarBound beyond_a_face = index.nearest({-7.5, 0.5, 4.0}).value();
  EXPECT_EQ(beyond_a_face.distance, 3.0);
  EXPECT_EQ(beyond_a_face.gradient, Vector3(0, 0, 1));
  const FarBound beyond_an_edge = index.nearest({-4.0, -4.0, 0.5}).value();
  EXPECT_EQ(beyond_an_edge.distance, 5.0);
  EXPECT_TRUE(beyond_an_edge.gradient.isApprox(Vector3(0.6, -0.8, 0)));
}

TEST(OccupancyIndex, OutliersFarAwayChangeNothingNearby) {
  std::mt19937 random(4);
  std::vector<OccupiedTile> tiles = random_tiles(50, 4, random);
  const OccupancyIndex without(tiles, 1.0);
  for (const std::int32_t far : {-1'250'000, 1'250'000, 1 << 30, -(1 << 30)}) {
    OccupiedTile outlier{{0, far, -far, far}, {}};
    outlier.cubes.set(100);
    tiles.push_back(outlier);
  }
  const OccupancyIndex with(tiles, 1.0);
  std::uniform_real_distribution<double> uniform(-50.0, 50.0);
  for (int i = 0; i < 500; ++i) {
    const Vector3 p(uniform(random), uniform(random), uniform(random));
    EXPECT_EQ(with.nearest(p).value().distance, without.nearest(p).value().distance);
  }
  EXPECT_LT(with.nearest({1e7, -1e7, 1e7}).value().distance, 20.0);
}

TEST(OccupancyIndex, KnowsWhichTilesAreOccupied) {
  std::mt19937 random(5);
  std::vector<OccupiedTile> tiles = random_tiles(100, 5, random);
  tiles.push_back({{0, 40, 40, 40}, {}});  // no cube of it
  const OccupancyIndex index(tiles, 1.0);
  for (std::size_t i = 0; i < 100; ++i) {
    ASSERT_NE(index.find(tiles[i].key), nullptr);
    EXPECT_EQ(index.find(tiles[i].key)->words(), tiles[i].cubes.words());
  }
  EXPECT_EQ(index.find({0, 40, 40, 40}), nullptr);
  EXPECT_EQ(index.find({0, 5, 5, 5}), nullptr);
}

TEST(OccupancyIndex, SaysNothingWithoutOccupiedCubes) {
  EXPECT_TRUE(OccupancyIndex({}, 1.0).empty());
  EXPECT_FALSE(OccupancyIndex({}, 1.0).nearest({1, 2, 3}).has_value());
  EXPECT_FALSE(OccupancyIndex({{{0, 1, 2, 3}, {}}}, 1.0).nearest({1, 2, 3}).has_value());
  EXPECT_EQ(OccupancyIndex({}, 1.0).find({}), nullptr);
}

}  // namespace
}  // namespace gdfmap
