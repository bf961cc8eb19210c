#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/train/exact_distance.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

/// A map of some points with everything that ExactDistance needs.
class ExactDistanceTest : public testing::Test {
 protected:
  void ingest(const std::vector<Vector3>& points) {
    map_.emplace(test::map_of(directory_ / "a.gdfmap", points));
    map_->points().for_each_tile([&](const TilePoints& tile) { tiles_.push_back(tile); });
    for (const Vector3& p : points) quantized_.push_back(*map_->lattice().quantize(p));
  }

  [[nodiscard]] double brute_force(const LatticePoint& p) const {
    double least = std::numeric_limits<double>::infinity();
    for (const LatticePoint& q : quantized_) {
      least =
          std::min(least, std::hypot(static_cast<double>(q.x - p.x), static_cast<double>(q.y - p.y),
                                     static_cast<double>(q.z - p.z)));
    }
    return least;
  }

  void expect_exact(const LatticePoint& origin, const std::vector<Eigen::Vector3i>& samples) {
    ExactDistance exact(map_->points(), tiles_, std::size_t{1} << 20);
    const std::vector<double> distances = exact.nearest(origin, samples, SampleOrder::kScattered);
    ASSERT_EQ(distances.size(), samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double expected = brute_force(
          {origin.x + samples[i].x(), origin.y + samples[i].y(), origin.z + samples[i].z()});
      EXPECT_NEAR(distances[i], expected, 2e-7 * expected) << samples[i].transpose();
    }
  }

  test::TemporaryDirectory directory_;
  std::optional<Map> map_;
  std::vector<TilePoints> tiles_;
  std::vector<LatticePoint> quantized_;
};

TEST_F(ExactDistanceTest, EqualsBruteForceAcrossTiles) {
  ingest(test::scene_points("sphere", 3000));
  std::vector<Eigen::Vector3i> samples;
  for (int x = -70000; x <= 70000; x += 23333) {
    for (int y = -70000; y <= 70000; y += 23333) samples.emplace_back(x, y, 1000 + x / 7);
  }
  expect_exact({0, 0, 0}, samples);
}

TEST_F(ExactDistanceTest, FindsPointsBeyondTheNearRings) {
  ingest({{500.0, 3.0, -2.0}, {-700.0, 0.0, 0.0}});
  expect_exact({0, 0, 0}, {{0, 0, 0}, {65536, 0, 0}, {-300000, 5, 9}});
}

TEST_F(ExactDistanceTest, IsExactFarFromTheWorldsOrigin) {
  ingest({{637291.5, 851210.25, 511.0}, {637295.0, 851211.0, 512.0}});
  const LatticePoint origin = tile_origin(tile_of(quantized_[0]));
  expect_exact(origin, {{0, 0, 0}, {30000, 1000, 65535}});
}

TEST_F(ExactDistanceTest, WithoutPointsIsInfinite) {
  test::TemporaryDirectory directory;
  Map map = Map::create(directory / "empty.gdfmap");
  ExactDistance exact(map.points(), {}, 0);
  const std::vector<Eigen::Vector3i> samples = {{1, 2, 3}};
  EXPECT_EQ(exact.nearest({0, 0, 0}, samples, SampleOrder::kScattered)[0],
            std::numeric_limits<double>::infinity());
}

/// A tile of more points than one index may have, a speck of it denser than one pass can divide.
TEST_F(ExactDistanceTest, OfManyGroupsIsTheSameUnitByUnit) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> within(0.5, 2.5), speck(5.0, 5.1);
  std::vector<Vector3> points;
  for (int i = 0; i < 400'000; ++i) {
    points.emplace_back(within(random), within(random), 0.2 * within(random));
    points.emplace_back(speck(random), speck(random), speck(random));
  }
  points.emplace_back(-20.0, 1.0, 1.0);
  ingest(points);
  std::vector<std::vector<Eigen::Vector3i>> samples(12);
  for (int g = 0; g < 10; ++g) {
    for (int i = 0; i < 64; ++i) {
      samples[static_cast<std::size_t>(g)].emplace_back(g * 6000 + i % 4 * 500, i / 4 % 4 * 500,
                                                        g * 3000 + i / 16 * 500);
    }
  }
  samples[10] = {{-150000, 9000, 8000}};  // the last group is empty
  std::vector<SampleGroup> groups;
  for (const auto& of_group : samples) groups.push_back({{0, 0, 0}, of_group});
  ExactDistance small(map_->points(), tiles_, 1 << 20), large(map_->points(), tiles_, 1 << 30);
  EXPECT_FALSE(small.can_keep(std::vector<TileKey>{{0, 0, 0, 0}}));
  EXPECT_FALSE(small.can_keep(std::vector<TileKey>{{1, 0, 0, 0}}));
  EXPECT_TRUE(small.can_keep(std::vector<TileKey>{{0, -3, 0, 0}}));
  EXPECT_TRUE(large.can_keep(std::vector<TileKey>{{0, 0, 0, 0}}));
  const auto unit_by_unit = small.nearest(groups, 2);
  ASSERT_EQ(unit_by_unit.size(), groups.size());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    EXPECT_EQ(unit_by_unit[g], large.nearest({0, 0, 0}, samples[g], SampleOrder::kPackets)) << g;
  }
  for (const std::size_t g : {0u, 8u, 10u}) {
    const Eigen::Vector3i& sample = samples[g].front();
    EXPECT_NEAR(unit_by_unit[g].front(), brute_force({sample.x(), sample.y(), sample.z()}),
                2e-7 * unit_by_unit[g].front());
  }
}

TEST_F(ExactDistanceTest, OfManyGroupsWithoutPointsIsInfinite) {
  test::TemporaryDirectory directory;
  Map map = Map::create(directory / "empty.gdfmap");
  ExactDistance exact(map.points(), {}, 0);
  const std::vector<Eigen::Vector3i> samples = {{1, 2, 3}};
  const SampleGroup group{{0, 0, 0}, samples};
  EXPECT_EQ(exact.nearest({&group, 1}, 1).front().front(), std::numeric_limits<double>::infinity());
}

TEST_F(ExactDistanceTest, DoesNotDependOnTheCache) {
  ingest(test::scene_points("box", 5000));
  std::vector<Eigen::Vector3i> samples;
  for (int i = 0; i < 500; ++i) samples.emplace_back(i * 131, -i * 57, i * 211);
  ExactDistance small(map_->points(), tiles_, 0), large(map_->points(), tiles_, 1 << 30);
  for (int round = 0; round < 2; ++round) {
    EXPECT_EQ(small.nearest({0, 0, 0}, samples, SampleOrder::kScattered),
              large.nearest({0, 0, 0}, samples, SampleOrder::kPackets));
  }
}

}  // namespace
}  // namespace gdfmap
