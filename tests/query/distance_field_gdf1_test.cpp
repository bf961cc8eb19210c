#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/query/distance_field.hpp>

#include "field_builder.hpp"

namespace gdfmap {
namespace {

using test::FieldBuilder;
using test::random_block;

/// The ancestor's blending, from its description, over absolute coordinates in double.
class AncestorField {
 public:
  AncestorField(const FieldBuilder& builder, double edge, double margin)
      : builder_(builder), edge_(edge), margin_(margin) {}

  struct Answer {
    bool valid = false;
    double distance = 0.0;
    Vector3 gradient = Vector3::Zero();
  };

  [[nodiscard]] Answer at(const Vector3& p) const {
    const std::array<std::int64_t, 3> own = {floor(p.x()), floor(p.y()), floor(p.z())};
    const CubeRecord* const cube = find(own);
    if (cube != nullptr && face_distance(own, p) >= margin_) {
      Answer answer{true, 0.0, Vector3::Zero()};
      accumulate(*cube, own, p, 1.0, answer);
      return answer;
    }
    Answer answer;
    double total = 0.0;
    for (std::int64_t x = own[0] - 1; x <= own[0] + 1; ++x) {
      for (std::int64_t y = own[1] - 1; y <= own[1] + 1; ++y) {
        for (std::int64_t z = own[2] - 1; z <= own[2] + 1; ++z) {
          const CubeRecord* const neighbour = find({x, y, z});
          if (neighbour == nullptr) continue;
          const double t = std::clamp(1.0 + face_distance({x, y, z}, p) / margin_, 0.0, 1.0);
          const double w = t * t * (3.0 - 2.0 * t);
          if (w <= 1e-6) continue;
          accumulate(*neighbour, {x, y, z}, p, w, answer);
          total += w;
        }
      }
    }
    answer.valid = total >= 1e-6;
    answer.distance /= total;
    answer.gradient /= total;
    return answer;
  }

 private:
  [[nodiscard]] std::int64_t floor(double v) const {
    return static_cast<std::int64_t>(std::floor(v / edge_));
  }
  [[nodiscard]] const CubeRecord* find(const std::array<std::int64_t, 3>& key) const {
    const auto found = builder_.cubes().find({0, key[0], key[1], key[2]});
    const bool usable =
        found != builder_.cubes().end() && found->second.status == CubeStatus::kFitted;
    return usable ? &found->second : nullptr;
  }
  [[nodiscard]] double face_distance(const std::array<std::int64_t, 3>& key,
                                     const Vector3& p) const {
    double nearest = 1e300;
    for (int a = 0; a < 3; ++a) {
      const double low = static_cast<double>(key[static_cast<std::size_t>(a)]) * edge_;
      nearest = std::min({nearest, p[a] - low, low + edge_ - p[a]});
    }
    return nearest;
  }
  void accumulate(const CubeRecord& cube, const std::array<std::int64_t, 3>& key, const Vector3& p,
                  double w, Answer& answer) const {
    const Vector3 origin = edge_ * Vector3(double(key[0]), double(key[1]), double(key[2]));
    const ValueGradient local = evaluate_with_gradient(Kernel(cube.gaussians).view(), p - origin);
    answer.distance += w * local.value;
    answer.gradient += w * local.gradient;
  }

  const FieldBuilder& builder_;
  double edge_, margin_;
};

TEST(DistanceFieldGdf1, BlendsAsTheAncestor) {
  const FieldBuilder builder = random_block(1, 0.3, 5);
  const AncestorField ancestor(builder, 1.0, 0.25);
  const DistanceField field(builder.source(), {.blend = BlendMode::kGdf1});
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(-3.4, 3.4);
  int num_unknown = 0;
  for (int i = 0; i < 5000; ++i) {
    Vector3 p(uniform(random), uniform(random), uniform(random));
    if (i % 3 == 0) p[i % 2] = std::round(p[i % 2]);
    const FieldSample sample = field.at(p);
    const AncestorField::Answer expected = ancestor.at(p);
    if (!expected.valid) {
      EXPECT_EQ(sample.status, FieldStatus::kUnknown) << p.transpose();
      EXPECT_TRUE(std::isnan(sample.distance));
      ++num_unknown;
      continue;
    }
    EXPECT_EQ(sample.status, FieldStatus::kFine) << p.transpose();
    EXPECT_NEAR(sample.distance, expected.distance, 1e-9);
    EXPECT_LT((sample.gradient - expected.gradient).norm(), 1e-8);
  }
  EXPECT_GT(num_unknown, 100);
  EXPECT_LT(num_unknown, 4000);
}

TEST(DistanceFieldGdf1, WeighsErrorsAsItWeighsDistances) {
  const FieldBuilder builder =
      FieldBuilder({})
          .add({0, 0, 0, 0}, test::constant_gaussians(1.0f), CubeStatus::kFitted, 0.5f)
          .add({0, 1, 0, 0}, test::constant_gaussians(3.0f), CubeStatus::kFitted, 0.25f);
  const DistanceField field(builder.source(), {.blend = BlendMode::kGdf1});
  const FieldSample on_face = field.at({1.0, 0.5, 0.5});  // both weigh 1
  EXPECT_NEAR(on_face.distance, 2.0, 1e-8);
  EXPECT_NEAR(on_face.expected_error, 0.375, 1e-12);
  EXPECT_LT(on_face.gradient.norm(), 1e-4);  // that of the cubes alone
}

TEST(DistanceFieldGdf1, HasNoFarBoundAndNoLevels) {
  const FieldBuilder builder = FieldBuilder({1.0, 0.25, 2})
                                   .add({0, 0, 0, 0}, test::constant_gaussians(1.0f))
                                   .add({1, 0, 0, 0}, test::constant_gaussians(1.0f))
                                   .occupy({0, 0, 0, 0});
  const DistanceField field(builder.source(), {.blend = BlendMode::kGdf1});
  EXPECT_EQ(field.at({1.2, 0.5, 0.5}).status, FieldStatus::kFine);
  EXPECT_EQ(field.at({1.3, 0.5, 0.5}).status, FieldStatus::kUnknown);
  EXPECT_EQ(field.at({NAN, 0.5, 0.5}).status, FieldStatus::kUnknown);
}

}  // namespace
}  // namespace gdfmap
