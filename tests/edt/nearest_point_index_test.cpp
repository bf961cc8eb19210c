#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/edt/nearest_point_index.hpp>

namespace gdfmap {
namespace {

using Points = std::vector<Eigen::Vector3f>;

Points random_points(std::size_t count, std::uint32_t seed, int low, int high) {
  std::mt19937 generator(seed);
  const auto coordinate = [&] {
    return static_cast<float>(low +
                              static_cast<int>(generator() % static_cast<unsigned>(high - low)));
  };
  Points points(count);
  for (Eigen::Vector3f& p : points) p = {coordinate(), coordinate(), coordinate()};
  return points;
}

float brute_force(const Points& points, const Eigen::Vector3f& p) {
  float best = std::numeric_limits<float>::infinity();
  for (const Eigen::Vector3f& q : points) {
    const float dx = q.x() - p.x(), dy = q.y() - p.y(), dz = q.z() - p.z();
    best = std::min(best, dx * dx + dy * dy + dz * dz);
  }
  return best;
}

void expect_exact(const Points& points, const Points& samples) {
  const NearestPointIndex index(points);
  std::vector<float> best(samples.size(), std::numeric_limits<float>::infinity());
  index.update(samples, best);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(best[i], brute_force(points, samples[i])) << i;
  }
}

TEST(NearestPointIndex, EqualsBruteForceForEveryNumberOfPoints) {
  for (const std::size_t count : {1u, 2u, 15u, 16u, 17u, 255u, 257u, 4097u, 20000u}) {
    expect_exact(random_points(count, static_cast<std::uint32_t>(count), 0, 65536),
                 random_points(300, 7, -131072, 196608));
  }
}

TEST(NearestPointIndex, EqualsBruteForceOnAPlane) {
  Points points = random_points(5000, 3, 0, 65536);
  for (Eigen::Vector3f& p : points) p.z() = 1234.0f;
  expect_exact(points, random_points(300, 5, 0, 65536));
}

TEST(NearestPointIndex, SurvivesIdenticalPoints) {
  expect_exact(Points(1000, Eigen::Vector3f(5, 6, 7)), random_points(50, 9, 0, 65536));
}

TEST(NearestPointIndex, DoesNotDependOnTheOrderOfPointsOrSamples) {
  Points points = random_points(3000, 11, 0, 65536);
  const Points samples = random_points(200, 13, 0, 65536);
  const auto distances = [&](const Points& of) {
    std::vector<float> best(samples.size(), std::numeric_limits<float>::infinity());
    NearestPointIndex(of).update(samples, best);
    return best;
  };
  const std::vector<float> before = distances(points);
  std::reverse(points.begin(), points.end());
  EXPECT_EQ(distances(points), before);
}

TEST(NearestPointIndex, OnlyLowersWhatIsAlreadyKnown) {
  const NearestPointIndex index(Points{{100, 100, 100}});
  const Points samples = {{100, 100, 110}, {100, 100, 200}};
  std::vector<float> best = {50.0f, 1e6f};
  index.update(samples, best);
  EXPECT_EQ(best[0], 50.0f);
  EXPECT_EQ(best[1], 10000.0f);
}

TEST(NearestPointIndex, WithoutPointsChangesNothing) {
  const NearestPointIndex index(Points{});
  std::vector<float> best = {3.0f};
  index.update(Points{{0, 0, 0}}, best);
  EXPECT_EQ(best[0], 3.0f);
}

}  // namespace
}  // namespace gdfmap
