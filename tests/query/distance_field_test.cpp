#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/query/distance_field.hpp>
#include <gdfmap/query/occupancy_index.hpp>

#include "field_builder.hpp"

namespace gdfmap {
namespace {

using test::constant_gaussians;
using test::FieldBuilder;
using test::random_block;
using test::random_gaussians;

/// These tests ask for more digits than the fast arithmetic has.
const DistanceFieldOptions kExact{.precision = Precision::kDouble};

/// The blended field written out: every cube of the block is asked for its weight.
class Reference {
 public:
  explicit Reference(const FieldBuilder& builder) : builder_(builder) {}

  /// Value and expected error; the far bound is left to the caller, by its share.
  struct Answer {
    double distance = 0.0;
    double share_of_coarse = 0.0, share_of_far = 1.0;
    double error = 0.0, weight = 0.0;
  };
  [[nodiscard]] Answer at(const Vector3& p) const {
    Answer answer;
    double share = 1.0;
    for (int level = 0; level < builder_.geometry().num_levels; ++level) {
      double sum = 0.0;
      for (const auto& [key, cube] : builder_.cubes()) {
        if (key.level != level || cube.status == CubeStatus::kFailed) continue;
        const double w = weight(key, p);
        if (w == 0.0) continue;
        sum += w;
        answer.distance += share * w * evaluate(Kernel(cube.gaussians).view(), p - origin(key));
        answer.error += share * w * static_cast<double>(cube.errors.mae);
        answer.weight += share * w;
      }
      share *= 1.0 - sum;
      if (level == 0) answer.share_of_coarse = share;
    }
    answer.share_of_far = share;
    return answer;
  }

 private:
  [[nodiscard]] double edge(int level) const {
    return builder_.geometry().cube_size * static_cast<double>(level_scale(level));
  }
  [[nodiscard]] Vector3 origin(const CubeKey& key) const {
    return edge(key.level) * Vector3(double(key.x), double(key.y), double(key.z));
  }
  /// Rises over the lower face and falls over the upper one, on each axis.
  [[nodiscard]] double weight(const CubeKey& key, const Vector3& p) const {
    const double e = edge(key.level), m = e / 4.0;
    const auto step = [](double t) {
      t = std::clamp(t, 0.0, 1.0);
      return t * t * (3.0 - 2.0 * t);
    };
    double product = 1.0;
    for (int a = 0; a < 3; ++a) {
      const double u = p[a] - origin(key)[a];
      product *= step((u + m) / (2.0 * m)) * step((e - u + m) / (2.0 * m));
    }
    return product;
  }

  const FieldBuilder& builder_;
};

Vector3 central_difference(const DistanceField& field, const Vector3& p, double h) {
  Vector3 gradient;
  for (int a = 0; a < 3; ++a) {
    const Vector3 step = h * Vector3::Unit(a);
    gradient[a] = (field.at(p + step).distance - field.at(p - step).distance) / (2.0 * h);
  }
  return gradient;
}

void expect_unknown(const FieldSample& sample) {
  EXPECT_EQ(sample.status, FieldStatus::kUnknown);
  EXPECT_TRUE(std::isnan(sample.distance));
  EXPECT_TRUE(sample.gradient.array().isNaN().all());
  EXPECT_TRUE(std::isnan(sample.expected_error));
}

/// Points everywhere in the block, and exactly on its faces, edges and corners.
std::vector<Vector3> points_of_interest(double cube_size, double extent, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-extent, extent);
  std::vector<Vector3> points;
  for (int i = 0; i < 3000; ++i) {
    Vector3 p(uniform(random), uniform(random), uniform(random));
    for (int a = 0; a < 3; ++a) {
      const auto kind = random() % 6;
      if (kind == 0) p[a] = std::round(p[a]);         // on a face
      if (kind == 1) p[a] = std::round(p[a]) + 0.25;  // where a margin begins
      if (kind == 2) p[a] = std::round(p[a]) - 0.25;
    }
    points.push_back(cube_size * p);
  }
  return points;
}

TEST(DistanceField, AnswersWithOneCubeAwayFromItsFaces) {
  std::mt19937 random(1);
  const Gaussians gaussians = random_gaussians(8, 1.0, random);
  const FieldBuilder builder =
      FieldBuilder({}).add({0, -3, 4, 0}, gaussians, CubeStatus::kFitted, 0.125f);
  const DistanceField field(builder.source(), kExact);
  const Vector3 p_local(0.3, 0.6, 0.5);
  const auto [distance, gradient, status, expected_error] = field.at(Vector3(-3, 4, 0) + p_local);
  const ValueGradient expected = evaluate_with_gradient(Kernel(gaussians).view(), p_local);
  EXPECT_NEAR(distance, expected.value, 1e-14);
  EXPECT_TRUE(gradient.isApprox(expected.gradient, 1e-12));
  EXPECT_EQ(status, FieldStatus::kFine);
  EXPECT_EQ(expected_error, 0.125);
}

TEST(DistanceField, IsTheMeanOfTwoCubesOnTheirCommonFace) {
  const FieldBuilder builder = FieldBuilder({})
                                   .add({0, -1, 0, 0}, constant_gaussians(1.0f))
                                   .add({0, 0, 0, 0}, constant_gaussians(3.0f));
  const DistanceField field(builder.source(), kExact);
  const FieldSample sample = field.at({0.0, 0.5, 0.5});
  EXPECT_NEAR(sample.distance, 2.0, 1e-8);
  EXPECT_NEAR(sample.gradient.x(), (3.0 - 1.0) * 1.5 / 0.5, 1e-7);  // smoothstep'(1/2) = 3/2
  EXPECT_EQ(sample.status, FieldStatus::kFine);
}

TEST(DistanceField, EqualsThePartitionOfUnityWrittenOut) {
  for (const double cube_size : {1.0, 0.3}) {
    const FieldBuilder builder = random_block(2, 0.3, 7, cube_size);
    const DistanceField field(builder.source(), kExact);
    const Reference reference(builder);
    int num_fine = 0, num_coarse = 0;
    for (const Vector3& p : points_of_interest(cube_size, 2.9, 8)) {
      const FieldSample sample = field.at(p);
      const Reference::Answer expected = reference.at(p);
      ASSERT_LT(expected.share_of_far, 1e-12);
      EXPECT_NEAR(sample.distance, expected.distance, 1e-12);
      EXPECT_NEAR(sample.expected_error, expected.error / expected.weight, 1e-12);
      num_fine += sample.status == FieldStatus::kFine;
      num_coarse += sample.status == FieldStatus::kCoarse;
      if (expected.share_of_coarse > 1e-12) {
        EXPECT_EQ(sample.status, FieldStatus::kCoarse);
      }
    }
    EXPECT_EQ(num_fine + num_coarse, 3000);
    EXPECT_GT(num_fine, 300);
    EXPECT_GT(num_coarse, 300);
  }
}

TEST(DistanceField, IsFineOnFacesAndMarginsOfAWholeBlock) {
  for (const double cube_size : {1.0, 0.3}) {
    const FieldBuilder builder = random_block(1, 0.0, 7, cube_size);
    const DistanceField field(builder.source(), kExact);
    for (const Vector3& p : points_of_interest(cube_size, 2.4, 9)) {
      EXPECT_EQ(field.at(p).status, FieldStatus::kFine) << p.transpose();
    }
  }
}

TEST(DistanceField, GradientIsTheDerivativeOfTheDistance) {
  const FieldBuilder builder = random_block(2, 0.3, 11);
  const DistanceField field(builder.source(), kExact);
  std::mt19937 random(12);
  std::uniform_real_distribution<double> uniform(-3.5, 3.5);
  for (int i = 0; i < 3000; ++i) {
    const Vector3 p(uniform(random), uniform(random), uniform(random));
    const FieldSample sample = field.at(p);
    ASSERT_NE(sample.status, FieldStatus::kFar);
    EXPECT_LT((central_difference(field, p, 1e-5) - sample.gradient).norm(), 1e-6) << p.transpose();
  }
}

TEST(DistanceField, GradientHoldsWhereTheFarBoundBlendsIn) {
  const FieldBuilder builder = FieldBuilder({})
                                   .add({0, 2, -1, 0}, constant_gaussians(0.7f))
                                   .occupy({0, 0, -1, 0});  // one box: a smooth bound
  const DistanceField field(builder.source(), kExact);
  std::mt19937 random(13);
  std::uniform_real_distribution<double> uniform(-0.24, 0.24);
  for (int i = 0; i < 500; ++i) {
    const Vector3 p(2.0 + uniform(random), -0.5 + uniform(random), 1.0 + uniform(random));
    const FieldSample sample = field.at(p);
    EXPECT_EQ(sample.status, FieldStatus::kFar);
    EXPECT_NEAR(sample.expected_error, 0.01, 1e-9);
    EXPECT_LT((central_difference(field, p, 1e-5) - sample.gradient).norm(), 1e-6);
  }
}

TEST(DistanceField, IsContinuouslyDifferentiableAcrossFacesEdgesAndMissingCubes) {
  const FieldBuilder builder = random_block(2, 0.4, 17);
  const DistanceField field(builder.source(), kExact);
  std::mt19937 random(18);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  constexpr double kStep = 1e-4;
  for (int line = 0; line < 20; ++line) {
    // Through a corner of cubes, along a diagonal of space, of a plane or any other way.
    Vector3 direction(uniform(random), uniform(random), uniform(random));
    if (line % 4 == 1) direction = {1, 1, 1};
    if (line % 4 == 2) direction = {1, -1, 0};
    direction.normalize();
    const Vector3 corner(line % 5 - 2, line % 3 - 1, line % 2 - 1);
    FieldSample last = field.at(corner - 0.3 * direction);
    for (int i = 1; i <= 6000; ++i) {
      const FieldSample next = field.at(corner + (i * kStep - 0.3) * direction);
      ASSERT_LT(std::abs(next.distance - last.distance), 30.0 * kStep);
      ASSERT_LT((next.gradient - last.gradient).norm(), 300.0 * kStep);
      last = next;
    }
  }
}

TEST(DistanceField, PoorCubesAreServedAndFailedOnesAreNot) {
  const FieldBuilder builder =
      FieldBuilder({1.0, 0.25, 2})
          .add({0, 0, 0, 0}, constant_gaussians(1.0f), CubeStatus::kPoor, 0.5f)
          .add({0, 1, 0, 0}, {}, CubeStatus::kFailed)
          .add({1, 0, 0, 0}, constant_gaussians(2.0f), CubeStatus::kFitted, 0.75f);
  const DistanceField field(builder.source(), kExact);
  const FieldSample poor = field.at({0.5, 0.5, 0.5});
  EXPECT_EQ(poor.status, FieldStatus::kFine);
  EXPECT_EQ(poor.expected_error, 0.5);
  const FieldSample failed = field.at({1.5, 1.5, 1.5});
  EXPECT_EQ(failed.status, FieldStatus::kCoarse);
  EXPECT_NEAR(failed.distance, 2.0, 1e-8);
  EXPECT_EQ(failed.expected_error, 0.75);
}

TEST(DistanceField, ExpectedErrorIsWeightedAsTheCubesContribute) {
  const FieldBuilder builder =
      FieldBuilder({1.0, 0.25, 2})
          .add({0, 0, 1, 1}, constant_gaussians(1.0f), CubeStatus::kFitted, 0.5f)
          .add({1, 0, 0, 0}, constant_gaussians(1.0f), CubeStatus::kFitted, 0.25f);
  const DistanceField field(builder.source(), kExact);
  EXPECT_NEAR(field.at({1.0, 1.5, 1.5}).expected_error, 0.375, 1e-12);  // half and half
  EXPECT_EQ(field.at({1.0, 1.5, 1.5}).status, FieldStatus::kCoarse);
}

TEST(DistanceField, UnknownErrorOfACubeLeavesTheExpectedErrorUnknown) {
  const float unknown = std::numeric_limits<float>::quiet_NaN();
  const FieldBuilder builder =
      FieldBuilder({}).add({0, 0, 0, 0}, constant_gaussians(1.0f), CubeStatus::kFitted, unknown);
  const FieldSample sample = DistanceField(builder.source(), kExact).at({0.5, 0.5, 0.5});
  EXPECT_EQ(sample.status, FieldStatus::kFine);
  EXPECT_TRUE(std::isnan(sample.expected_error));
}

TEST(DistanceField, ErrorBoundIsWeightedAsTheCubesContribute) {
  const FieldBuilder builder =
      FieldBuilder({1.0, 0.25, 2})
          .add({0, 0, 1, 1}, constant_gaussians(3.0f), CubeStatus::kFitted, 0.5f)
          .add({1, 0, 0, 0}, constant_gaussians(3.0f), CubeStatus::kFitted, 0.25f);
  const DistanceField field(builder.source(), kExact);
  // The builder records twice the mean error as the largest.
  const FieldSample sample = field.at({1.0, 1.5, 1.5});
  EXPECT_NEAR(sample.error_bound, 0.75, 1e-12);
  EXPECT_NEAR(sample.conservative_distance(), 3.0 - FieldSample::kSafetyFactor * 0.75, 1e-7);
}

TEST(DistanceField, ConservativeDistanceIsTheFarBoundWhereThatIsAlone) {
  const FieldBuilder builder =
      FieldBuilder({}).add({0, 0, 0, 0}, constant_gaussians(0.1f)).occupy({0, 0, 0, 0});
  const FieldSample sample = DistanceField(builder.source()).at({-6.0, 0.5, 0.5});
  EXPECT_EQ(sample.status, FieldStatus::kFar);
  EXPECT_EQ(sample.error_bound, 0.0);
  EXPECT_NEAR(sample.conservative_distance(), 6.0, 1e-12);
}

TEST(DistanceField, ConservativeDistancePassesNoCheckWhereTheBoundIsNotKnown) {
  const float unknown = std::numeric_limits<float>::quiet_NaN();
  const FieldBuilder builder =
      FieldBuilder({}).add({0, 0, 0, 0}, constant_gaussians(1.0f), CubeStatus::kFitted, unknown);
  const DistanceField field(builder.source());
  for (const Vector3& p : {Vector3(0.5, 0.5, 0.5), Vector3(9.0, 0.5, 0.5)}) {
    const FieldSample sample = field.at(p);
    EXPECT_FALSE(sample.conservative_distance() > 0.0);
    double alone = 0.0;
    field.conservative_distances(std::span(&p, 1), std::span(&alone, 1));
    EXPECT_TRUE(std::isnan(alone));
  }
}

TEST(DistanceField, ConservativeDistanceIsNeverNegative) {
  const FieldBuilder builder =
      FieldBuilder({}).add({0, 0, 0, 0}, constant_gaussians(0.1f), CubeStatus::kFitted, 0.5f);
  EXPECT_EQ(DistanceField(builder.source()).at({0.5, 0.5, 0.5}).conservative_distance(), 0.0);
}

TEST(DistanceField, SamplesBindTheirFirstFourMembers) {
  const FieldSample sample{1.0, Vector3::UnitX(), FieldStatus::kFine, 0.5, 2.0};
  const auto [distance, gradient, status, expected_error] = sample;
  EXPECT_EQ(distance, 1.0);
  EXPECT_EQ(gradient, Vector3::UnitX());
  EXPECT_EQ(status, FieldStatus::kFine);
  EXPECT_EQ(expected_error, 0.5);
}

TEST(DistanceField, FarAwayItIsALowerBoundThatPointsAwayFromTheNearestBox) {
  const FieldBuilder builder = FieldBuilder({})
                                   .add({0, 0, 0, 0}, constant_gaussians(0.1f))
                                   .occupy({0, 0, 0, 0})
                                   .occupy({0, 5, 5, 5});
  const DistanceField field(builder.source(), kExact);
  const FieldSample sample = field.at({-6.0, 0.5, -7.0});
  EXPECT_EQ(sample.status, FieldStatus::kFar);
  EXPECT_NEAR(sample.distance, std::hypot(6.0, 7.0), 1e-12);
  EXPECT_TRUE(sample.gradient.isApprox(Vector3(-6, 0, -7).normalized()));
  EXPECT_TRUE(std::isnan(sample.expected_error));

  std::mt19937 random(19);
  std::uniform_real_distribution<double> anywhere(-1000.0, 1000.0), within(0.0, 1.0);
  for (int i = 0; i < 1000; ++i) {
    const Vector3 p(anywhere(random), anywhere(random), anywhere(random));
    const Vector3 point(within(random), within(random), within(random));  // of the cloud
    EXPECT_LE(field.at(p).distance, (p - point).norm());
    EXPECT_LE(field.at(p).distance, (p - point - Vector3(5, 5, 5)).norm());
  }
}

TEST(DistanceField, FarBoundInsideAnOccupiedBoxIsZeroWithoutDirection) {
  const FieldBuilder builder =
      FieldBuilder({}).add({0, 0, 0, 0}, {}, CubeStatus::kFailed).occupy({0, 0, 0, 0});
  const FieldSample sample = DistanceField(builder.source(), kExact).at({0.5, 0.5, 0.5});
  EXPECT_EQ(sample.status, FieldStatus::kFar);
  EXPECT_EQ(sample.distance, 0.0);
  EXPECT_EQ(sample.gradient, Vector3::Zero());
}

TEST(DistanceField, WhatCubesLeaveIsTheBoundFromTheNearestOccupiedCube) {
  std::mt19937 random(23);
  std::bernoulli_distribution half(0.5), quarter(0.25);
  FieldBuilder ones({}), threes({});
  for (std::int64_t i = 0; i < 125; ++i) {
    const CubeKey key{0, 5 + i % 5, 5 + i / 5 % 5, 5 + i / 25};
    if (half(random)) {
      ones.add(key, constant_gaussians(1.0f));
      threes.add(key, constant_gaussians(3.0f));
    }
    if (quarter(random)) {
      ones.occupy(key);
      threes.occupy(key);
    }
  }
  const DistanceField one(ones.source(), kExact), three(threes.source(), kExact);
  const OccupancyIndex occupancy(ones.source()->occupied(), 1.0);
  std::uniform_real_distribution<double> around(4.0, 11.0);
  int num_partly = 0, num_in_occupied = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vector3 p(around(random), around(random), around(random));
    const FieldSample sample = one.at(p);
    if (sample.status == FieldStatus::kUnknown) continue;  // a tile with points, without cubes
    const double weight = 0.5 * (three.at(p).distance - sample.distance);
    const double bound = occupancy.nearest(p)->distance;
    EXPECT_NEAR(sample.distance, weight + (1.0 - weight) * bound, 1e-6) << p.transpose();
    if (weight < 1e-3 || weight > 0.999) continue;
    ++num_partly;
    if (bound == 0.0) ++num_in_occupied;
  }
  EXPECT_GT(num_partly, 500);
  EXPECT_GT(num_in_occupied, 100);
}

TEST(DistanceField, KnowsNothingWithoutCubes) {
  const FieldBuilder builder = FieldBuilder({}).occupy({0, 0, 0, 0});
  const DistanceField field(builder.source(), kExact);
  expect_unknown(field.at({0.5, 0.5, 0.5}));
  expect_unknown(field.at({500.0, 0.5, 0.5}));
}

TEST(DistanceField, KnowsNothingWhereATileHoldsPointsAndWaitsForItsCubes) {
  const FieldBuilder builder = FieldBuilder({1.0, 0.25, 2})
                                   .add({0, 0, 0, 0}, constant_gaussians(0.1f))
                                   .add({1, 2, 0, 0}, constant_gaussians(0.1f))
                                   .occupy({0, 0, 0, 0})
                                   .occupy({0, 8, 0, 0});
  const DistanceField field(builder.source(), kExact);
  expect_unknown(field.at({8.5, 0.5, 0.5}));
  expect_unknown(field.at({15.0, 7.0, 7.0}));
  EXPECT_EQ(field.at({16.5, 0.5, 0.5}).status, FieldStatus::kFar);
  EXPECT_EQ(field.at({0.5, 0.5, 0.5}).status, FieldStatus::kFine);
}

TEST(DistanceField, KnowsNothingOfPointsThatAreNowhere) {
  const FieldBuilder builder = random_block(1, 0.0, 1);
  const DistanceField field(builder.source(), kExact);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinity, -infinity, 1e300, -1e11}) {
    expect_unknown(field.at({bad, 0, 0}));
    expect_unknown(field.at({0, bad, 0}));
    expect_unknown(field.at({0, 0, bad}));
  }
  EXPECT_EQ(field.at({1e7, -1e7, 1e7}).status, FieldStatus::kFar);
}

TEST(DistanceField, NeedsAnOccupiedCubeForAFarBound) {
  const FieldBuilder builder = FieldBuilder({}).add({0, 0, 0, 0}, constant_gaussians(0.1f));
  const DistanceField field(builder.source(), kExact);
  EXPECT_EQ(field.at({0.5, 0.5, 0.5}).status, FieldStatus::kFine);
  expect_unknown(field.at({5.5, 0.5, 0.5}));
}

TEST(DistanceField, ServesModelsOfAnyMargin) {
  for (const double margin : {0.0, 0.01, 0.5, 3.0}) {
    const FieldBuilder builder = FieldBuilder({1.0, margin, 1})
                                     .add({0, 0, 0, 0}, constant_gaussians(1.0f))
                                     .add({0, 1, 0, 0}, constant_gaussians(1.0f))
                                     .occupy({0, 0, 0, 0});
    const DistanceField field(builder.source(), kExact);
    for (const double x : {0.5, 0.999, 1.0, 1.3}) {
      const FieldSample sample = field.at({x, 0.5, 0.5});
      EXPECT_NEAR(sample.distance, 1.0, 1e-8);
      EXPECT_TRUE(sample.gradient.allFinite());
    }
  }
}

TEST(DistanceField, RefusesAGeometryThatCannotBeUsed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Geometry& geometry :
       {Geometry{0.0, 0.25, 1}, Geometry{1.0, -0.1, 1}, Geometry{1.0, nan, 1},
        Geometry{1.0, 0.25, 0}, Geometry{1.0, 0.25, kMaxLevels + 1}}) {
    try {
      const DistanceField field(FieldBuilder(geometry).source());
      ADD_FAILURE() << "accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kUsage);
    }
  }
}

}  // namespace
}  // namespace gdfmap
