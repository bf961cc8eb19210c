#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <gdfmap/align/ndt_cells.hpp>
#include <gdfmap/core/error.hpp>

namespace gdfmap {
namespace {

const Lattice kLattice(1.0);
/// A place in UTM coordinates.
const Vector3 kFarPlace(412345.6, 4512345.7, 212.3);

std::vector<LatticePoint> lattice_points(const std::vector<Vector3>& points) {
  std::vector<LatticePoint> result;
  for (const Vector3& p : points) result.push_back(kLattice.quantize(p).value());
  return result;
}

/// Points in a ball around a place.
std::vector<LatticePoint> cloud_around(const Vector3& place, std::size_t count, double radius,
                                       unsigned seed = 5) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-radius, radius);
  std::vector<Vector3> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(place + Vector3(uniform(random), uniform(random), uniform(random)));
  }
  return lattice_points(points);
}

VoxelGrid grid_of(const std::vector<LatticePoint>& points, double edge = 1.0) {
  VoxelGrid grid(kLattice, edge);
  for (const LatticePoint& p : points) grid.add(p);
  return grid;
}

/// The textbook way: the mean first, then the deviations, in long double.
Eigen::Matrix<long double, 3, 3> two_pass_covariance(const std::vector<LatticePoint>& points) {
  using LongVector = Eigen::Matrix<long double, 3, 1>;
  const auto as_vector = [](const LatticePoint& p) {
    return LongVector(static_cast<long double>(p.x), static_cast<long double>(p.y),
                      static_cast<long double>(p.z));
  };
  const auto step = static_cast<long double>(kLattice.step());
  LongVector sum = LongVector::Zero();
  for (const LatticePoint& p : points) sum += as_vector(p);
  const LongVector mean = sum / static_cast<long double>(points.size());
  Eigen::Matrix<long double, 3, 3> scatter = Eigen::Matrix<long double, 3, 3>::Zero();
  for (const LatticePoint& p : points) {
    const LongVector d = step * (as_vector(p) - mean);
    scatter += d * d.transpose();
  }
  return scatter / static_cast<long double>(points.size() - 1);
}

/// One pass over world coordinates in double, as grids of normal distributions often do it.
Eigen::Matrix3d naive_covariance(const std::vector<LatticePoint>& points) {
  Vector3 sum = Vector3::Zero();
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (const LatticePoint& p : points) {
    const Vector3 v = kLattice.to_world(p);
    sum += v;
    products += v * v.transpose();
  }
  const auto n = static_cast<double>(points.size());
  return (products - sum * sum.transpose() / n) / (n - 1.0);
}

TEST(VoxelGrid, IsTheSameBitForBitWhateverTheOrder) {
  std::vector<LatticePoint> points = cloud_around(kFarPlace, 5000, 4.0);
  const VoxelGrid grid = grid_of(points);
  const NdtCells cells(grid, points.front());
  std::mt19937 random(1);
  std::shuffle(points.begin(), points.end(), random);
  const LatticePoint origin = cells.origin();
  const VoxelGrid shuffled = grid_of(points);
  EXPECT_TRUE(shuffled == grid);

  const NdtCells again(shuffled, origin);
  ASSERT_EQ(again.cells().size(), cells.cells().size());
  for (std::size_t i = 0; i < cells.cells().size(); ++i) {
    EXPECT_EQ(again.cells()[i].voxel, cells.cells()[i].voxel);
    EXPECT_EQ(again.cells()[i].mean, cells.cells()[i].mean);
    EXPECT_EQ(again.cells()[i].covariance, cells.cells()[i].covariance);
    EXPECT_EQ(again.cells()[i].inverse_covariance, cells.cells()[i].inverse_covariance);
  }
}

TEST(VoxelGrid, WhatIsAddedAndRemovedWasNeverThere) {
  const std::vector<LatticePoint> stay = cloud_around(kFarPlace, 1000, 2.0, 1);
  const std::vector<LatticePoint> go = cloud_around(kFarPlace + Vector3(1, 1, 0), 3000, 4.0, 2);
  const VoxelGrid expected = grid_of(stay);
  VoxelGrid one_by_one = grid_of(go);
  for (const LatticePoint& p : stay) one_by_one.add(p);
  EXPECT_FALSE(one_by_one == expected);
  for (const LatticePoint& p : go) one_by_one.remove(p);
  EXPECT_TRUE(one_by_one == expected);

  VoxelGrid at_once = grid_of(stay);
  at_once += grid_of(go);
  at_once -= grid_of(go);
  EXPECT_TRUE(at_once == expected);
}

TEST(VoxelGrid, OfTwoTilesIsTheSumOfThoseOfEach) {
  // Voxels of 3 m straddle the face between two tiles at x = 8.
  const std::vector<LatticePoint> points = cloud_around({8.0, 4.0, 4.0}, 4000, 1.5);
  VoxelGrid sum(kLattice, 3.0);
  for (const TileKey tile : {TileKey{0, 0, 0, 0}, TileKey{0, 1, 0, 0}}) {
    std::vector<TileOffset> offsets;
    const LatticePoint origin = tile_origin(tile);
    for (const LatticePoint& p : points) {
      if (tile_of(p) != tile) continue;
      offsets.push_back({static_cast<std::uint16_t>(p.x - origin.x),
                         static_cast<std::uint16_t>(p.y - origin.y),
                         static_cast<std::uint16_t>(p.z - origin.z)});
    }
    ASSERT_GT(offsets.size(), 1000U);
    VoxelGrid part(kLattice, 3.0);
    part.add(tile, offsets);
    sum += part;
  }
  EXPECT_TRUE(sum == grid_of(points, 3.0));
}

TEST(VoxelGrid, RefusesToGiveWhatItDoesNotHold) {
  VoxelGrid grid(kLattice, 1.0);
  grid.add({1, 2, 3});
  EXPECT_THROW(grid.remove({-1, 2, 3}), Error);
  EXPECT_THROW(grid -= grid_of(cloud_around(Vector3::Zero(), 100, 0.9)), Error);
  EXPECT_THROW(grid += VoxelGrid(kLattice, 2.0), Error);
  EXPECT_THROW(VoxelGrid(kLattice, 0.0), Error);
  EXPECT_THROW(VoxelGrid(kLattice, 129.0), Error);
  EXPECT_THROW(VoxelGrid(kLattice, std::nan("")), Error);
}

TEST(NdtCells, HaveTheCovarianceOfTwoPassesFarFromTheWorldsOrigin) {
  const Vector3 centre = kFarPlace.array().floor() + 0.5;  // of a voxel
  const std::vector<LatticePoint> points = cloud_around(centre, 2000, 0.45);
  const VoxelGrid grid = grid_of(points);
  const NdtCells cells(grid, kLattice.quantize(kFarPlace).value());
  ASSERT_EQ(cells.cells().size(), 1U);
  const Eigen::Matrix3d expected = two_pass_covariance(points).cast<double>();
  const double error = (cells.cells()[0].covariance - expected).cwiseAbs().maxCoeff();
  EXPECT_LT(error, 1e-14);
  // What the integers are for.
  EXPECT_GT((naive_covariance(points) - expected).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(NdtCells, KeepTheirDistributionWhenPointsAreAddedASecondTime) {
  const std::vector<LatticePoint> points = cloud_around({0.5, 0.5, 0.5}, 500, 0.4);
  VoxelGrid grid = grid_of(points);
  grid += grid_of(points);
  const Eigen::Matrix3d once = NdtCells(grid_of(points), {}).cells()[0].covariance;
  const Eigen::Matrix3d twice = NdtCells(grid, {}).cells()[0].covariance;
  // Twice the scatter over 2n − 1 instead of n − 1.
  EXPECT_LT((twice - once * (2.0 * 499 / 999)).norm(), 1e-15);
}

TEST(NdtCells, ReadANoisyPlaneAsThinAsItIs) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> uniform(-0.45, 0.45);
  std::normal_distribution<double> noise(0.0, 0.02);
  const Vector3 centre = kFarPlace.array().floor() + 0.5;
  const Vector3 normal = Vector3(0.1, -0.2, 1.0).normalized();
  const Vector3 u = normal.cross(Vector3::UnitX()).normalized(), v = normal.cross(u);
  std::vector<Vector3> points;
  for (int i = 0; i < 400; ++i) {
    points.push_back(centre + uniform(random) * u * 0.8 + uniform(random) * v * 0.8 +
                     noise(random) * normal);
  }
  const NdtCells cells(grid_of(lattice_points(points)), kLattice.quantize(centre).value());
  ASSERT_EQ(cells.cells().size(), 1U);
  const NdtCell& cell = cells.cells()[0];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(cell.covariance);
  EXPECT_NEAR(std::sqrt(solver.eigenvalues()(0)), 0.02, 0.002);
  EXPECT_GT(std::abs(solver.eigenvectors().col(0).dot(normal)), 0.999);
  EXPECT_LT(cell.mean.norm(), 0.05);
}

TEST(NdtCells, AreInvertedWithTheirSmallerEigenvaluesRaised) {
  // On a line: two eigenvalues are zero.
  std::vector<LatticePoint> line;
  for (std::int64_t i = 0; i < 8; ++i) line.push_back({100 + 1000 * i, 4000, 4000});
  const NdtCells cells(grid_of(line), {});
  ASSERT_EQ(cells.cells().size(), 1U);
  const NdtCell& cell = cells.cells()[0];
  const double variance = cell.covariance(0, 0);
  EXPECT_NEAR(variance, 6e6 * kLattice.step() * kLattice.step(), 1e-15);
  EXPECT_NEAR(cell.inverse_covariance(0, 0) * variance, 1.0, 1e-12);
  EXPECT_NEAR(cell.inverse_covariance(1, 1) * variance, 100.0, 1e-9);
  EXPECT_NEAR(cell.inverse_covariance(2, 2) * variance, 100.0, 1e-9);
}

TEST(NdtCells, NeedSixPointsThatDoNotAllCoincide) {
  std::vector<LatticePoint> points = cloud_around({0.5, 0.5, 0.5}, 5, 0.4);
  EXPECT_TRUE(NdtCells(grid_of(points), {}).cells().empty());
  points.push_back({4000, 4000, 4000});
  EXPECT_EQ(NdtCells(grid_of(points), {}).cells().size(), 1U);
  EXPECT_TRUE(NdtCells(grid_of(std::vector<LatticePoint>(9, {1, 2, 3})), {}).cells().empty());
}

TEST(NdtCells, AreFoundByThePlaceOfAPoint) {
  const std::vector<LatticePoint> points = cloud_around(kFarPlace, 20000, 6.0);
  const VoxelGrid grid = grid_of(points, 1.5);
  const NdtCells cells(grid, kLattice.quantize(kFarPlace + Vector3(3, -2, 1)).value());
  const Vector3 origin = kLattice.to_world(cells.origin());
  std::size_t num_found = 0;
  for (const LatticePoint& p : points) {
    const VoxelKey voxel = grid.voxel_of(p);
    const NdtCell* const cell = cells.at(kLattice.to_world(p) - origin);
    const bool expected = grid.voxels().at(voxel).count() >= kMinNdtPoints;
    ASSERT_EQ(cell != nullptr, expected);
    if (cell == nullptr) continue;
    ++num_found;
    EXPECT_EQ(cell->voxel, voxel);
    EXPECT_LT((cell->mean - (kLattice.to_world(p) - origin)).norm(), 1.5 * std::sqrt(3.0));
  }
  EXPECT_GT(num_found, 10000U);
  EXPECT_EQ(cells.at({1e6, 0.0, 0.0}), nullptr);
}

TEST(NdtCells, AreFoundAroundAPoint) {
  // Every voxel of 5 x 5 x 5 is filled.
  std::vector<LatticePoint> points;
  for (int i = 0; i < 125; ++i) {
    const Vector3 centre(i % 5 - 2 + 0.5, i / 5 % 5 - 2 + 0.5, i / 25 - 2 + 0.5);
    for (const LatticePoint& p : cloud_around(centre, 8, 0.4, 7)) points.push_back(p);
  }
  const NdtCells cells(grid_of(points), {});
  ASSERT_EQ(cells.cells().size(), 125U);
  std::array<const NdtCell*, kMaxNdtNeighbors> found{};
  const Vector3 p(-0.5, 0.5, 1.5);
  ASSERT_EQ(cells.around(p, NdtNeighborhood::kOwn, found), 1U);
  EXPECT_EQ(found[0]->voxel, (VoxelKey{-1, 0, 1}));
  const auto l1_distance = [&](const NdtCell& cell) {
    return std::abs(cell.voxel.x + 1) + std::abs(cell.voxel.y) + std::abs(cell.voxel.z - 1);
  };
  ASSERT_EQ(cells.around(p, NdtNeighborhood::kFaces, found), 7U);
  EXPECT_EQ(l1_distance(*found[0]), 0);
  for (std::size_t i = 1; i < 7; ++i) EXPECT_EQ(l1_distance(*found[i]), 1);
  ASSERT_EQ(cells.around(p, NdtNeighborhood::kAll, found), 27U);
  std::sort(found.begin(), found.end());
  EXPECT_EQ(std::unique(found.begin(), found.end()), found.end());
  // In a corner of the filled block, 8 of the 27 are there.
  EXPECT_EQ(cells.around({-1.5, -1.5, -1.5}, NdtNeighborhood::kAll, found), 8U);
  EXPECT_EQ(cells.around({-1.5, -1.5, -1.5}, NdtNeighborhood::kFaces, found), 4U);
}

}  // namespace
}  // namespace gdfmap
