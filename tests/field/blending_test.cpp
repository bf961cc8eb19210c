#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/field/blending.hpp>

namespace gdfmap {
namespace {

constexpr double kEdge = 1.0, kMargin = 0.25;

std::vector<BlendTerm> terms_at(const Vector3& p) {
  const CubeKey own{0, static_cast<std::int64_t>(std::floor(p.x())),
                    static_cast<std::int64_t>(std::floor(p.y())),
                    static_cast<std::int64_t>(std::floor(p.z()))};
  std::vector<BlendTerm> terms;
  visit_partition_of_unity(own, p, kEdge, kMargin, [&](const BlendTerm& term) {
    EXPECT_TRUE(term.p_local.isApprox(
        p - Vector3(double(term.cube.x), double(term.cube.y), double(term.cube.z)), 1e-15));
    terms.push_back(term);
    return true;
  });
  return terms;
}

double weight_of(const CubeKey& cube, const Vector3& p) {
  for (const BlendTerm& term : terms_at(p)) {
    if (term.cube == cube) return term.weight;
  }
  return 0.0;
}

TEST(PartitionOfUnity, ACubesInteriorIsItsOwn) {
  const std::vector<BlendTerm> terms = terms_at({3.5, -2.5, 0.5});
  ASSERT_EQ(terms.size(), 1u);
  EXPECT_EQ(terms[0].cube, (CubeKey{0, 3, -3, 0}));
  EXPECT_EQ(terms[0].weight, 1.0);
  EXPECT_EQ(terms[0].weight_gradient, Vector3::Zero());
}

TEST(PartitionOfUnity, CubesShareAFaceEvenly) {
  EXPECT_NEAR(weight_of({0, 0, 0, 0}, {1.0 - 1e-12, 0.5, 0.5}), 0.5, 1e-9);
  EXPECT_NEAR(weight_of({0, 1, 0, 0}, {1.0 - 1e-12, 0.5, 0.5}), 0.5, 1e-9);
}

TEST(PartitionOfUnity, EightCubesMeetAtACorner) {
  const std::vector<BlendTerm> terms = terms_at({0.0, 0.0, 0.0});
  ASSERT_EQ(terms.size(), 8u);
  for (const BlendTerm& term : terms) EXPECT_DOUBLE_EQ(term.weight, 0.125);
}

TEST(PartitionOfUnity, WeightsSumToOneAndTheirGradientsToZero) {
  for (double x = -1.0; x < 1.0; x += 0.0937) {
    for (double y = -1.0; y < 1.0; y += 0.1171) {
      for (double z = -1.0; z < 1.0; z += 0.0713) {
        const std::vector<BlendTerm> terms = terms_at({x, y, z});
        double sum = 0.0;
        Vector3 gradient = Vector3::Zero();
        for (const BlendTerm& term : terms) {
          sum += term.weight;
          gradient += term.weight_gradient;
        }
        EXPECT_NEAR(sum, 1.0, 1e-14);
        EXPECT_NEAR(gradient.norm(), 0.0, 1e-13);
      }
    }
  }
}

TEST(PartitionOfUnity, GradientsEqualCentralDifferencesAcrossFacesEdgesAndCorners) {
  const double h = 1e-6;
  const CubeKey cube{0, 0, 0, 0};
  for (const Vector3& p : {Vector3(1.05, 0.5, 0.5), Vector3(0.98, 1.02, 0.5),
                           Vector3(0.9, 0.95, 1.1), Vector3(0.1, -0.05, 0.02)}) {
    for (const BlendTerm& term : terms_at(p)) {
      if (!(term.cube == cube)) continue;
      for (int a = 0; a < 3; ++a) {
        const Vector3 step = h * Vector3::Unit(a);
        const double difference = (weight_of(cube, p + step) - weight_of(cube, p - step)) / (2 * h);
        EXPECT_NEAR(term.weight_gradient[a], difference, 1e-6) << p.transpose();
      }
    }
  }
}

TEST(PartitionOfUnity, EndsWhenTheVisitorHasSeenEnough) {
  int visits = 0;
  EXPECT_FALSE(visit_partition_of_unity({}, {0.1, 0.1, 0.1}, kEdge, kMargin,
                                        [&](const BlendTerm&) { return ++visits < 3; }));
  EXPECT_EQ(visits, 3);
}

TEST(PartitionOfUnity, TermsComeInKeyOrder) {
  const std::vector<BlendTerm> terms = terms_at({0.9, 0.05, 0.95});
  ASSERT_EQ(terms.size(), 8u);
  for (std::size_t i = 1; i < 8; ++i) EXPECT_LT(terms[i - 1].cube, terms[i].cube);
}

TEST(Gdf1BlendWeight, FallsFromOneAtTheFaceToZeroAtTheMargin) {
  EXPECT_EQ(gdf1_blend_weight({0.5, 0.5, 0.5}, kEdge, kMargin), 1.0);
  EXPECT_EQ(gdf1_blend_weight({0.5, 0.0, 0.5}, kEdge, kMargin), 1.0);
  EXPECT_DOUBLE_EQ(gdf1_blend_weight({0.5, -0.125, 0.5}, kEdge, kMargin), 0.5);
  EXPECT_EQ(gdf1_blend_weight({0.5, 0.5, 1.25}, kEdge, kMargin), 0.0);
}

}  // namespace
}  // namespace gdfmap
