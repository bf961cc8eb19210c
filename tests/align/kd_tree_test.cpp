#include <algorithm>

#include <gtest/gtest.h>

#include <gdfmap/align/kd_tree.hpp>

#include "align_fixtures.hpp"

namespace gdfmap {
namespace {

TEST(KdTree, FindsWhatTryingAllPointsFinds) {
  const std::vector<Vector3> points = test::corner_points(2000, 5.0, 0.1, 1);
  const std::vector<Vector3> queries = test::corner_points(200, 6.0, 0.5, 2);
  const KdTree tree(points);
  for (const Vector3& q : queries) {
    const auto nearer = [&](const Vector3& a, const Vector3& b) {
      return (a - q).squaredNorm() < (b - q).squaredNorm();
    };
    const auto best = std::min_element(points.begin(), points.end(), nearer);
    const auto found = tree.nearest(q, 0.2);
    ASSERT_EQ(found.has_value(), (*best - q).norm() < 0.2);
    if (found) {
      EXPECT_EQ(*found, best - points.begin());
    }
    // A guess, however wrong, changes nothing.
    EXPECT_EQ(tree.nearest(q, 0.2, 17), found);
  }
}

TEST(KdTree, TellsTheNearestInTheirOrder) {
  const std::vector<Vector3> points = test::corner_points(500, 5.0, 0.1, 1);
  std::vector<std::uint32_t> order(points.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const Vector3 q(1.0, 2.0, 0.5);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return (points[a] - q).squaredNorm() < (points[b] - q).squaredNorm();
  });
  std::vector<std::uint32_t> found;
  KdTree(points).nearest(q, 7, found);
  EXPECT_EQ(found, std::vector<std::uint32_t>(order.begin(), order.begin() + 7));
}

TEST(KdTree, HasAnAnswerForFewPointsAndForNone) {
  const std::vector<Vector3> none, two = {Vector3::Zero(), Vector3::Ones()};
  EXPECT_FALSE(KdTree(none).nearest(Vector3::Zero(), 1.0));
  std::vector<std::uint32_t> found;
  KdTree(two).nearest(Vector3::Zero(), 5, found);
  EXPECT_EQ(found.size(), 2u);
}

}  // namespace
}  // namespace gdfmap
