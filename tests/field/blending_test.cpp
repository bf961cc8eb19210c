#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/field/blending.hpp>

namespace gdfmap {
namespace {

constexpr double kEdge = 1.0, kMargin = 0.25;

struct Term {
  CubeKey cube;
  Vector3 p_local = Vector3::Zero();
  double weight = 0.0;
  Vector3 weight_gradient = Vector3::Zero();
};

BlendZone zone_at(const Vector3& p) { return BlendZones(0, kEdge, kMargin).zone_of(p).value(); }

std::vector<Term> terms_at(const Vector3& p) {
  const BlendZone zone = zone_at(p);
  std::vector<Term> terms;
  visit_cubes(zone, [&](const CubeKey& cube) { terms.push_back({cube}); });
  const auto along = [&](std::size_t axis) {
    return BlendZones(0, kEdge, kMargin)
        .blend(zone.half_cubes[axis], p[static_cast<Eigen::Index>(axis)]);
  };
  std::size_t i = 0;
  visit_partition_of_unity(along(0), along(1), along(2), [&](const BlendTerm<double>& term) {
    Term& t = terms.at(i++);
    t.p_local = Vector3(term.p_local);
    t.weight = term.weight;
    t.weight_gradient = Vector3(term.weight_gradient);
    const Vector3 corner(double(t.cube.x), double(t.cube.y), double(t.cube.z));
    EXPECT_LT((t.p_local - (p - corner)).norm(), 1e-14);
  });
  EXPECT_EQ(i, terms.size());
  return terms;
}

double weight_of(const CubeKey& cube, const Vector3& p) {
  for (const Term& term : terms_at(p)) {
    if (term.cube == cube) return term.weight;
  }
  return 0.0;
}

TEST(BlendZone, SpansBothSidesOfAFace) {
  const BlendZone inside = zone_at({0.5, 0.5, 0.5});
  EXPECT_EQ(inside, zone_at({0.26, 0.74, 0.5}));
  const BlendZone face = zone_at({0.8, 0.5, 0.5});
  EXPECT_NE(face, inside);
  EXPECT_EQ(face, zone_at({1.0, 0.5, 0.5}));
  EXPECT_EQ(face, zone_at({1.24, 0.3, 0.7}));
  EXPECT_NE(face, zone_at({1.26, 0.5, 0.5}));
  EXPECT_EQ(zone_at({-0.1, -1.1, 0.1}), zone_at({0.1, -0.9, -0.1}));
}

TEST(BlendZone, IsTheInsideAloneForAMarginOfNothing) {
  const auto zone = BlendZones(0, 1.0, 1e-12).zone_of({1e-9, 0.5, 1.0 - 1e-9});
  EXPECT_EQ(zone.value().half_cubes, (std::array<std::int64_t, 3>{1, 1, 1}));
}

TEST(BlendZone, IsNowhereForWhatIsNoPlaceOfTheLattice) {
  const BlendZones zones(0, kEdge, kMargin);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(zones.zone_of({0.0, std::numeric_limits<double>::quiet_NaN(), 0.0}));
  EXPECT_FALSE(zones.zone_of({kInfinity, 0.0, 0.0}));
  EXPECT_FALSE(zones.zone_of({0.0, 0.0, 1e18}));
}

TEST(PartitionOfUnity, ACubesInteriorIsItsOwn) {
  const std::vector<Term> terms = terms_at({3.5, -2.5, 0.5});
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
  const std::vector<Term> terms = terms_at({0.0, 0.0, 0.0});
  ASSERT_EQ(terms.size(), 8u);
  for (const Term& term : terms) EXPECT_DOUBLE_EQ(term.weight, 0.125);
}

TEST(PartitionOfUnity, WeightsSumToOneAndTheirGradientsToZero) {
  for (double x = -1.0; x < 1.0; x += 0.0937) {
    for (double y = -1.0; y < 1.0; y += 0.1171) {
      for (double z = -1.0; z < 1.0; z += 0.0713) {
        const std::vector<Term> terms = terms_at({x, y, z});
        double sum = 0.0;
        Vector3 gradient = Vector3::Zero();
        for (const Term& term : terms) {
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
    for (const Term& term : terms_at(p)) {
      if (!(term.cube == cube)) continue;
      for (int a = 0; a < 3; ++a) {
        const Vector3 step = h * Vector3::Unit(a);
        const double difference = (weight_of(cube, p + step) - weight_of(cube, p - step)) / (2 * h);
        EXPECT_NEAR(term.weight_gradient[a], difference, 1e-6) << p.transpose();
      }
    }
  }
}

TEST(PartitionOfUnity, TermsComeInKeyOrder) {
  const std::vector<Term> terms = terms_at({0.9, 0.05, 0.95});
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
