// The field has no jumps: lines through faces, edges, corners, borders of levels and missing cubes.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/query/distance_field.hpp>

#include "field_builder.hpp"

namespace gdfmap {
namespace {

constexpr double kCubeSize = 1.0;
/// So far apart stand the two sides of what may be a jump, metres.
constexpr double kGap = 2e-7;

/// Fine and coarse cubes, a third of either missing, all under whole cubes of level 2, so that
/// nothing within 3 m is far.
test::FieldBuilder patchwork() {
  std::mt19937 random(71);
  test::FieldBuilder builder({kCubeSize, kMarginRatio * kCubeSize, 3});
  const auto fill = [&](int level, std::int64_t low, std::int64_t high, unsigned present_of_6) {
    const double edge = kCubeSize * static_cast<double>(level_scale(level));
    for (std::int64_t x = low; x < high; ++x) {
      for (std::int64_t y = low; y < high; ++y) {
        for (std::int64_t z = low; z < high; ++z) {
          if (random() % 6 >= present_of_6) continue;
          builder.add({level, x, y, z}, test::random_gaussians(12, edge, random));
        }
      }
    }
  };
  fill(0, -4, 4, 4);
  fill(1, -2, 2, 4);
  fill(2, -1, 1, 6);
  return builder.occupy({0, 0, 0, 0});
}

/// A place where something changes along a line: on a face, where a margin begins, or on an edge or
/// a corner of those; crossed in any direction, along a diagonal or along an axis.
struct Crossing {
  Vector3 place, direction;
};
Crossing random_crossing(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Crossing crossing{3.0 * Vector3(uniform(random), uniform(random), uniform(random)),
                    {uniform(random), uniform(random), uniform(random)}};
  const auto count = 1 + static_cast<int>(random() % 3);
  for (int i = 0; i < count; ++i) {
    double& p = crossing.place[static_cast<Eigen::Index>((random() + i) % 3)];
    p = std::round(4.0 * p) / 4.0;
  }
  if (random() % 3 == 0) crossing.direction = crossing.direction.array().sign();
  if (random() % 6 == 0) crossing.direction = Vector3::Unit(static_cast<int>(random() % 3));
  crossing.direction.normalize();
  return crossing;
}

struct Jumps {
  double value = 0.0, gradient = 0.0;  ///< largest
};

/// Over `count` crossings, in units of the bars: value against the edge of the coarsest cube that
/// contributes, what the gradient makes of the gap taken off.
Jumps largest_jumps(const DistanceField& field, std::size_t count) {
  std::mt19937 random(72);
  std::vector<Vector3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const Crossing crossing = random_crossing(random);
    points.push_back(crossing.place - 0.5 * kGap * crossing.direction);
    points.push_back(crossing.place + 0.5 * kGap * crossing.direction);
  }
  std::vector<FieldSample> samples(points.size());
  field.at(points, samples);
  Jumps jumps;
  for (std::size_t i = 0; i < points.size(); i += 2) {
    const FieldSample &before = samples[i], &after = samples[i + 1];
    EXPECT_LE(std::max(before.status, after.status), FieldStatus::kCoarse);
    const Vector3 mean_gradient = 0.5 * (before.gradient + after.gradient);
    const double jump =
        after.distance - before.distance - mean_gradient.dot(points[i + 1] - points[i]);
    const bool is_fine = before.status == FieldStatus::kFine && after.status == FieldStatus::kFine;
    jumps.value = std::max(jumps.value, std::abs(jump) / (is_fine ? kCubeSize : 4.0 * kCubeSize));
    jumps.gradient = std::max(jumps.gradient, (after.gradient - before.gradient).norm());
  }
  return jumps;
}

void expect_continuous(std::size_t num_lines) {
  const test::FieldBuilder builder = patchwork();
  for (const Precision precision : {Precision::kFloat, Precision::kDouble}) {
    const Jumps jumps =
        largest_jumps(DistanceField(builder.source(), {.precision = precision}), num_lines);
    EXPECT_LE(jumps.value, 1e-5);
    EXPECT_LE(jumps.gradient, 1e-3);
    const std::string name = precision == Precision::kFloat ? "float" : "double";
    ::testing::Test::RecordProperty("value_jump_" + name,
                                    std::to_string(1e9 * jumps.value) + "e-9");
    ::testing::Test::RecordProperty("gradient_jump_" + name,
                                    std::to_string(1e9 * jumps.gradient) + "e-9");
  }
}

TEST(Continuity, NoJumpsOnAnyLine) { expect_continuous(20'000); }
TEST(Continuity, SoakNoJumpsOnAHundredThousandLines) { expect_continuous(100'000); }

}  // namespace
}  // namespace gdfmap
