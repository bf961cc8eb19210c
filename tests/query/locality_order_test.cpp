#include "query/locality_order.hpp"

#include <array>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace gdfmap {
namespace {

const BlendZones kZones(0, 1.0, 0.25);

/// 8 m wide.
std::vector<Vector3> cloud_around(const Vector3& center) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-4.0, 4.0);
  std::vector<Vector3> points;
  for (int i = 0; i < 20'000; ++i) {
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    points.push_back(center + Vector3(x, y, z));
  }
  return points;
}

class LocalityOrder : public ::testing::TestWithParam<Vector3> {};

TEST_P(LocalityOrder, HasThePointsOfAZoneInARowAndSaysSo) {
  const std::vector<Vector3> points = cloud_around(GetParam());
  const std::vector<OrderedPoint> order = locality_order(points, kZones);
  ASSERT_EQ(order.size(), points.size());
  std::vector<bool> is_there(points.size());
  std::map<std::array<std::int64_t, 3>, int> num_rows;
  for (const OrderedPoint& point : order) {
    EXPECT_FALSE(is_there[point.index]);
    is_there[point.index] = true;
    EXPECT_NE(point.zone, ZoneChange::kUnknown);
    if (point.zone == ZoneChange::kOther)
      ++num_rows[kZones.zone_of(points[point.index])->half_cubes];
  }
  EXPECT_GT(num_rows.size(), 4000u);
  for (const auto& [zone, count] : num_rows) EXPECT_EQ(count, 1);
}

INSTANTIATE_TEST_SUITE_P(, LocalityOrder,
                         ::testing::Values(Vector3(0, 0, 0), Vector3(3, -700, 1e6),
                                           Vector3(-5e5, 4.5e6, -20)),
                         [](const auto& at) { return "Place" + std::to_string(at.index); });

TEST(LocalityOrderOfOddPoints, DoesNotSayWhatItDoesNotKnow) {
  std::vector<Vector3> points = cloud_around({0, 0, 0});
  points.emplace_back(std::numeric_limits<double>::quiet_NaN(), 0, 0);
  for (const OrderedPoint& point : locality_order(points, kZones)) {
    EXPECT_EQ(point.zone, ZoneChange::kUnknown);
  }
  points.back() = {1e8, 0, 0};
  const std::vector<OrderedPoint> order = locality_order(points, kZones);
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (order[i].zone == ZoneChange::kUnknown) continue;
    EXPECT_EQ(order[i].zone == ZoneChange::kNone,
              kZones.zone_of(points[order[i].index]) == kZones.zone_of(points[order[i - 1].index]));
  }
  EXPECT_TRUE(locality_order({}, kZones).empty());
}

}  // namespace
}  // namespace gdfmap
