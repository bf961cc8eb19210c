// The vector kernels against the reference in double precision, on every instruction set.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/query/distance_field.hpp>

#include "field_builder.hpp"

namespace gdfmap {
namespace {

using test::FieldBuilder;

/// As many Gaussians in a cube as any fit gives it, a part of the cubes missing on every level.
FieldBuilder full_block(double cube_size) {
  std::mt19937 random(41);
  FieldBuilder builder({cube_size, kMarginRatio * cube_size, 3});
  const auto fill = [&](int level, std::int64_t low, std::int64_t high, unsigned present_of_8) {
    const double edge = cube_size * static_cast<double>(level_scale(level));
    for (std::int64_t x = low; x < high; ++x) {
      for (std::int64_t y = low; y < high; ++y) {
        for (std::int64_t z = low; z < high; ++z) {
          if (random() % 8 >= present_of_8) continue;
          const std::size_t count = 1 + random() % 40;
          // One draw after the other: compilers differ in the order of a call's arguments.
          const float error = static_cast<float>(random() % 100) * 1e-3f;
          builder.add({level, x, y, z}, test::random_gaussians(count, edge, random),
                      CubeStatus::kFitted, error);
        }
      }
    }
  };
  fill(0, -4, 4, 6);
  fill(1, -2, 2, 6);
  fill(2, -1, 1, 8);
  return builder.occupy({0, 0, 0, 0}).occupy({0, -3, 2, 1});
}

/// Everywhere, far away, exactly on faces and where margins begin.
std::vector<Vector3> points_around(double cube_size) {
  std::mt19937 random(42);
  std::uniform_real_distribution<double> fine(-4.5, 4.5), far(-40.0, 40.0);
  std::vector<Vector3> points;
  for (int i = 0; i < 20000; ++i) {
    auto& range = i % 8 == 0 ? far : fine;
    Vector3 p;
    for (int a = 2; a >= 0; --a) p[a] = range(random);
    for (int a = 0; a < 3; ++a) {
      const auto kind = random() % 8;
      if (kind == 0) p[a] = std::round(p[a]);
      if (kind == 1) p[a] = std::round(p[a]) + 0.25;
      if (kind == 2) p[a] = std::round(p[a]) - 0.25;
    }
    points.push_back(cube_size * p);
  }
  return points;
}

std::vector<FieldSample> answers(const FieldBuilder& builder, std::span<const Vector3> points,
                                 const DistanceFieldOptions& options) {
  std::vector<FieldSample> samples(points.size());
  DistanceField(builder.source(), options).at(points, samples);
  return samples;
}

class EveryInstructionSet : public ::testing::TestWithParam<InstructionSet> {
 protected:
  void SetUp() override {
    if (!is_supported(GetParam())) GTEST_SKIP() << "no " << name_of(GetParam()) << " here";
  }
};

TEST_P(EveryInstructionSet, AgreesWithTheReference) {
  for (const double cube_size : {1.0, 0.1, 30.0}) {
    const FieldBuilder builder = full_block(cube_size);
    const std::vector<Vector3> points = points_around(cube_size);
    const auto expected = answers(builder, points, {.precision = Precision::kDouble});
    const auto fast = answers(builder, points, {.instruction_set = GetParam()});
    int counts[4] = {};
    for (std::size_t i = 0; i < points.size(); ++i) {
      const FieldSample &a = expected[i], &b = fast[i];
      ASSERT_EQ(a.status, b.status);
      ++counts[static_cast<int>(a.status)];
      if (a.status == FieldStatus::kUnknown) continue;
      // What lies under a coarse answer is level 1 at least.
      const double edge = a.status == FieldStatus::kFine ? cube_size : 4.0 * cube_size;
      ASSERT_NEAR(a.distance, b.distance, 1e-5 * edge) << points[i].transpose();
      ASSERT_LT((a.gradient - b.gradient).norm(), 1e-4) << points[i].transpose();
      ASSERT_EQ(std::isnan(a.expected_error), std::isnan(b.expected_error));
      if (!std::isnan(a.expected_error)) {
        ASSERT_NEAR(a.expected_error, b.expected_error, 1e-8 + 1e-5 * a.expected_error);
      }
    }
    EXPECT_GT(counts[static_cast<int>(FieldStatus::kFine)], 1000);
    EXPECT_GT(counts[static_cast<int>(FieldStatus::kCoarse)], 1000);
    EXPECT_GT(counts[static_cast<int>(FieldStatus::kFar)], 500);
  }
}

/// One to nine points near each other, which share their cubes or some of them.
TEST_P(EveryInstructionSet, CompanyChangesNoAnswer) {
  const FieldBuilder builder = full_block(1.0);
  std::mt19937 random(43);
  std::normal_distribution<double> near(0.0, 0.2);
  std::vector<Vector3> points;
  for (const Vector3& p : points_around(1.0)) {
    if (points.size() > 20'000) break;
    for (auto i = random() % 300; i > 0; i /= 2) {
      points.push_back(p + Vector3(near(random), near(random), near(random)));
    }
  }
  for (const Precision precision : {Precision::kFloat, Precision::kDouble}) {
    const DistanceFieldOptions options{.precision = precision, .instruction_set = GetParam()};
    const auto together = answers(builder, points, options);
    const DistanceField field(builder.source(), options);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const FieldSample alone = field.at(points[i]);
      ASSERT_EQ(alone.status, together[i].status);
      if (alone.status == FieldStatus::kUnknown) continue;
      ASSERT_EQ(alone.distance, together[i].distance) << points[i].transpose();
      ASSERT_EQ(alone.gradient, together[i].gradient) << points[i].transpose();
      ASSERT_EQ(alone.error_bound, together[i].error_bound) << points[i].transpose();
    }
  }
}

TEST_P(EveryInstructionSet, DistancesAloneAreTheSame) {
  const FieldBuilder builder = full_block(1.0);
  const std::vector<Vector3> points = points_around(1.0);
  for (const Precision precision : {Precision::kFloat, Precision::kDouble}) {
    const DistanceFieldOptions options{.precision = precision, .instruction_set = GetParam()};
    const auto samples = answers(builder, points, options);
    std::vector<double> distances(points.size());
    DistanceField(builder.source(), options).distances(points, distances);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_EQ(distances[i], samples[i].distance) << points[i].transpose();
    }
  }
}

TEST_P(EveryInstructionSet, GradientIsTheDerivativeOfTheDistance) {
  const FieldBuilder builder = full_block(1.0);
  const DistanceField field(builder.source(), {.instruction_set = GetParam()});
  // Its own distances have too few digits to be subtracted from each other.
  const DistanceField reference(builder.source(), {.precision = Precision::kDouble});
  constexpr double kStep = 1e-5;
  int num_checked = 0;
  for (const Vector3& p : points_around(1.0)) {
    const FieldSample sample = field.at(p);
    if (sample.status > FieldStatus::kCoarse) continue;
    if (++num_checked > 2000) break;
    for (int a = 0; a < 3; ++a) {
      const Vector3 step = kStep * Vector3::Unit(a);
      const double difference =
          (reference.at(p + step).distance - reference.at(p - step).distance) / (2.0 * kStep);
      ASSERT_NEAR(difference, sample.gradient[a], 1e-3) << p.transpose();
    }
  }
  EXPECT_GT(num_checked, 2000);
}

INSTANTIATE_TEST_SUITE_P(, EveryInstructionSet,
                         ::testing::Values(InstructionSet::kPortable, InstructionSet::kAvx2,
                                           InstructionSet::kAvx512),
                         [](const auto& set) {
                           return set.param == InstructionSet::kAvx512 ? "Avx512"
                                  : set.param == InstructionSet::kAvx2 ? "Avx2"
                                                                       : "Portable";
                         });

}  // namespace
}  // namespace gdfmap
