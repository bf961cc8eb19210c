#include <cmath>
#include <limits>
#include <optional>

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
