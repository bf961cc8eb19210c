#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/synthetic_scene.hpp>

#include "../../src/pipeline/synthetic/hash_stream.hpp"
#include "../../src/pipeline/synthetic/patch.hpp"
#include "../../src/pipeline/synthetic/patch_tree.hpp"
#include "../../src/pipeline/synthetic/scene_builder.hpp"

namespace gdfmap {
namespace {

using synthetic::HashStream;
using synthetic::Patch;
using synthetic::PatchKind;

Vector3 random_point(const Box3& box, double margin, HashStream& random) {
  Vector3 p;
  for (Eigen::Index a = 0; a < 3; ++a) {
    p[a] = random.uniform(box.min()[a] - margin, box.max()[a] + margin);
  }
  return p;
}

double brute_force_distance(const std::vector<Patch>& patches, const Vector3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const Patch& patch : patches) best = std::min(best, synthetic::distance(patch, p));
  return best;
}

/// Patches of every kind in oblique frames.
std::vector<Patch> oblique_patches() {
  const Vector3 n = Vector3(1.0, -2.0, 2.0) / 3.0, u = Vector3(2.0, 2.0, 1.0) / 3.0;
  const Vector3 v = n.cross(u), origin(0.3, -0.7, 1.1);
  return {{PatchKind::kRectangle, origin, u, v, n, 1.5, 0.4, 0.0},
          {PatchKind::kFrustum, origin, u, v, n, 0.8, 0.8, 1.7},  // cylinder
          {PatchKind::kFrustum, origin, u, v, n, 1.2, 0.3, 0.9},  // cone's part
          {PatchKind::kFrustum, origin, u, v, n, 0.0, 0.6, 0.5},  // cone on its tip
          {PatchKind::kFrustum, origin, u, v, n, 1.1, 0.0, 0.0},  // disc
          {PatchKind::kFrustum, origin, u, v, n, 0.9, 0.5, 0.0},  // ring
          {PatchKind::kSphere, origin, u, v, n, 0.7, 0.0, 0.0}};
}

TEST(SyntheticPatch, HasPointsAtDistanceZeroAndNormalsThatLeadAway) {
  for (const Patch& patch : oblique_patches()) {
    HashStream random(5);
    for (int i = 0; i < 500; ++i) {
      const double s = random.uniform();
      const auto [position, normal] = synthetic::point_on(patch, s, random.uniform());
      EXPECT_LT(synthetic::distance(patch, position), 1e-14);
      EXPECT_NEAR(normal.norm(), 1.0, 1e-12);
      EXPECT_NEAR(synthetic::distance(patch, position + 1e-3 * normal), 1e-3, 1e-9);
      Box3 box = synthetic::bounding_box(patch);
      EXPECT_TRUE(Box3(box.min().array() - 1e-12, box.max().array() + 1e-12).contains(position));
    }
  }
}

/// The distance cannot be larger than to any sample, nor much smaller than to the nearest of many.
TEST(SyntheticPatch, MeasuresTheDistanceToItsPoints) {
  constexpr int kSide = 150;
  for (const Patch& patch : oblique_patches()) {
    std::vector<Vector3> points;
    for (int i = 0; i < kSide; ++i) {
      for (int j = 0; j < kSide; ++j) {
        points.push_back(synthetic::point_on(patch, (i + 0.5) / kSide, (j + 0.5) / kSide).position);
      }
    }
    HashStream random(6);
    for (int k = 0; k < 30; ++k) {
      const Vector3 p = random_point(synthetic::bounding_box(patch), 1.0, random);
      double nearest = std::numeric_limits<double>::infinity();
      for (const Vector3& q : points) nearest = std::min(nearest, (p - q).norm());
      EXPECT_LE(synthetic::distance(patch, p), nearest + 1e-12);
      EXPECT_GE(synthetic::distance(patch, p), nearest - 0.1);
    }
  }
}

/// Halves of a patch hold the share of the samples that their area has.
TEST(SyntheticPatch, SamplesAFrustumUniformlyByArea) {
  const Patch whole = oblique_patches()[2];
  Patch lower = whole;
  lower.b = 0.5 * (whole.a + whole.b);
  lower.h = 0.5 * whole.h;
  const double expected = synthetic::area(lower) / synthetic::area(whole);
  constexpr int kCount = 100000;
  int num_lower = 0;
  for (int i = 0; i < kCount; ++i) {
    const Vector3 p = synthetic::point_on(whole, (i + 0.5) / kCount, 0.3).position;
    num_lower += (p - whole.origin).dot(whole.n) < lower.h ? 1 : 0;
  }
  EXPECT_NEAR(num_lower / static_cast<double>(kCount), expected, 1e-4);
}

TEST(SyntheticPatch, KnowsTheAreasOfSchool) {
  const auto patches = oblique_patches();
  EXPECT_DOUBLE_EQ(synthetic::area(patches[0]), 4.0 * 1.5 * 0.4);
  EXPECT_DOUBLE_EQ(synthetic::area(patches[1]), 2.0 * M_PI * 0.8 * 1.7);
  EXPECT_DOUBLE_EQ(synthetic::area(patches[3]), M_PI * 0.6 * std::hypot(0.6, 0.5));
  EXPECT_DOUBLE_EQ(synthetic::area(patches[4]), M_PI * 1.1 * 1.1);
  EXPECT_DOUBLE_EQ(synthetic::area(patches[6]), 4.0 * M_PI * 0.7 * 0.7);
}

TEST(SyntheticPatchTree, GivesTheDistanceOfAllPatchesBitForBit) {
  for (const auto& patches : {synthetic::make_room(30.0, 1), synthetic::make_city(150.0, 2)}) {
    const synthetic::PatchTree tree(patches);
    Box3 bounds;
    for (const Patch& patch : patches) bounds.extend(synthetic::bounding_box(patch));
    HashStream random(7);
    for (int i = 0; i < 1000; ++i) {
      const Vector3 p = random_point(bounds, i % 10 == 0 ? 300.0 : 3.0, random);
      EXPECT_EQ(tree.distance(p), brute_force_distance(patches, p));
    }
  }
}

TEST(SyntheticScene, KnowsItsDistancesInClosedForm) {
  const SyntheticScene plane("plane", 6.0), sphere("sphere", 6.0), box("box", 6.0);
  HashStream random(8);
  for (int i = 0; i < 1000; ++i) {
    const Vector3 p = random_point(Box3(Vector3(-5, -5, -5), Vector3(5, 5, 5)), 0.0, random);
    const Vector3 beyond = (p.cwiseAbs() - Vector3::Constant(3.0));
    const Vector3 outside = beyond.cwiseMax(0.0);
    EXPECT_NEAR(plane.distance(p), Vector3(outside.x(), outside.y(), p.z()).norm(), 1e-12);
    EXPECT_NEAR(sphere.distance(p), std::abs(p.norm() - 3.0), 1e-12);
    const double inside = -beyond.maxCoeff();
    EXPECT_NEAR(box.distance(p), inside > 0.0 ? inside : outside.norm(), 1e-12);
  }
  EXPECT_DOUBLE_EQ(plane.area(), 36.0);
  EXPECT_DOUBLE_EQ(box.area(), 6.0 * 36.0);
  EXPECT_NEAR(sphere.area(), 36.0 * M_PI, 1e-9);
}

TEST(SyntheticScene, HasSamplesOnItsSurface) {
  for (const SceneInfo& info : scenes()) {
    const SyntheticScene scene(info.name);
    for (std::uint64_t i = 0; i < 5000; ++i) {
      const Vector3 p = scene.sample(i, 42, 0.0);
      EXPECT_LT(scene.distance(p), 1e-9) << info.name;
      EXPECT_LT(scene.bounds().exteriorDistance(p), 1e-9) << info.name;
    }
  }
}

TEST(SyntheticScene, SpreadsSamplesOverPatchesByArea) {
  const SyntheticScene scene("box");
  // Six faces, 60000 samples: chi-square with 5 degrees of freedom exceeds 20.5 once in a thousand.
  constexpr int kCount = 60000;
  std::map<int, int> counts;
  for (std::uint64_t i = 0; i < kCount; ++i) {
    const Vector3 p = scene.sample(i, 3, 0.0);
    Eigen::Index axis = 0;
    p.cwiseAbs().maxCoeff(&axis);
    ++counts[static_cast<int>(axis) * 2 + (p[axis] > 0.0 ? 1 : 0)];
  }
  double chi_square = 0.0;
  for (const auto& [face, count] : counts) chi_square += std::pow(count - kCount / 6.0, 2);
  EXPECT_EQ(counts.size(), 6u);
  EXPECT_LT(chi_square / (kCount / 6.0), 20.5);
}

TEST(SyntheticScene, SpreadsSamplesOverTheRoomByArea) {
  const SyntheticScene room("room", 12.0);
  constexpr int kCount = 200000;
  int on_floor = 0, on_ceiling = 0;
  for (std::uint64_t i = 0; i < kCount; ++i) {
    const double z = room.sample(i, 9, 0.0).z();
    on_floor += z == 0.0 ? 1 : 0;
    on_ceiling += z == 3.0 ? 1 : 0;
  }
  const double share = 144.0 / room.area();
  const double tolerance = 4.0 * std::sqrt(share * (1.0 - share) / kCount);
  EXPECT_NEAR(on_floor / static_cast<double>(kCount), share, tolerance);
  EXPECT_NEAR(on_ceiling / static_cast<double>(kCount), share, tolerance);
}

TEST(SyntheticScene, FillsASphereEvenly) {
  const SyntheticScene sphere("sphere", 2.0);
  constexpr int kCount = 40000;
  Vector3 sum = Vector3::Zero();
  Vector3 squares = Vector3::Zero();
  for (std::uint64_t i = 0; i < kCount; ++i) {
    const Vector3 p = sphere.sample(i, 1, 0.0);
    sum += p;
    squares += p.cwiseAbs2();
  }
  // Each coordinate is uniform in [-1, 1]: mean 0 ± 0.0029, mean square 1/3 ± 0.0015.
  EXPECT_LT((sum / kCount).cwiseAbs().maxCoeff(), 0.012);
  EXPECT_LT((squares / kCount - Vector3::Constant(1.0 / 3.0)).cwiseAbs().maxCoeff(), 0.006);
}

TEST(SyntheticScene, HasADistanceThatNeverGrowsFasterThanOneMoves) {
  for (const char* name : {"room", "city"}) {
    const SyntheticScene scene(name);
    HashStream random(11);
    for (int i = 0; i < 5000; ++i) {
      const Vector3 p = random_point(scene.bounds(), 2.0, random);
      const double length = std::pow(10.0, random.uniform(-6.0, 0.5));
      const Vector3 q =
          p + length * (random_point(Box3(Vector3(-1, -1, -1), Vector3(1, 1, 1)), 0.0, random));
      EXPECT_LE(std::abs(scene.distance(p) - scene.distance(q)), (p - q).norm() + 1e-12);
    }
  }
}

TEST(SyntheticScene, IsTheSameForTheSameNameAndSize) {
  for (const SceneInfo& info : scenes()) {
    const SyntheticScene a(info.name, info.default_size), b(info.name);
    EXPECT_EQ(a.num_patches(), b.num_patches());
    for (std::uint64_t i : {0u, 1u, 17u, 1000000u}) {
      EXPECT_EQ(a.sample(i, 5, 0.01), b.sample(i, 5, 0.01));
    }
  }
}

/// Guards the promise that a scene is the same everywhere and in later versions: figures and
/// benchmark tables refer to it.
/// Means of the squared coordinates of a scene's first samples.
Vector3 spread(const SyntheticScene& scene) {
  constexpr int kCount = 100'000;
  Vector3 sum = Vector3::Zero();
  for (int i = 0; i < kCount; ++i) {
    sum += scene.sample(static_cast<std::uint64_t>(i), 1, 0.0).cwiseAbs2();
  }
  return sum / kCount;
}

/// Whatever the compiler: it may draw random numbers that are arguments of one call in any order.
TEST(SyntheticScene, KeepsItsGeometry) {
  const SyntheticScene room("room"), city("city");
  EXPECT_EQ(room.num_patches(), 277u);
  EXPECT_EQ(city.num_patches(), 588u);
  EXPECT_NEAR(room.area(), 374.442882208, 1e-6);
  EXPECT_NEAR(city.area(), 25347.224811896, 1e-6);
  const Vector3 of_room(10.268913376463, 10.539079487333, 3.456890902154);
  const Vector3 of_city(795.790473617236, 774.356777570679, 82.173005039902);
  EXPECT_LT((spread(room) - of_room).norm(), 1e-8);
  EXPECT_LT((spread(city) - of_city).norm(), 1e-8);
}

TEST(SyntheticScene, DrawsOtherPointsForOtherSeedsAndIndices) {
  const SyntheticScene scene("room");
  for (std::uint64_t i = 0; i < 1000; ++i) {
    EXPECT_NE(scene.sample(i, 1, 0.0), scene.sample(i, 2, 0.0));
    EXPECT_NE(scene.sample(i, 1, 0.0), scene.sample(i + 1, 1, 0.0));
  }
}

TEST(SyntheticScene, DisplacesSamplesAlongTheNormal) {
  const SyntheticScene plane("plane");
  constexpr int kCount = 100000;
  constexpr double kNoise = 0.02;
  double sum = 0.0, squares = 0.0, fourth = 0.0;
  for (std::uint64_t i = 0; i < kCount; ++i) {
    const Vector3 p = plane.sample(i, 4, kNoise), exact = plane.sample(i, 4, 0.0);
    EXPECT_EQ(p.head<2>(), exact.head<2>());
    const double z = p.z() / kNoise;
    sum += z;
    squares += z * z;
    fourth += z * z * z * z;
  }
  EXPECT_NEAR(sum / kCount, 0.0, 0.013);
  EXPECT_NEAR(squares / kCount, 1.0, 0.018);
  EXPECT_NEAR(fourth / kCount, 3.0, 0.13);  // of a normal distribution
}

TEST(SyntheticScene, GrowsByMoreObjects) {
  EXPECT_GT(SyntheticScene("room", 20.0).num_patches(),
            3 * SyntheticScene("room", 10.0).num_patches());
  const SyntheticScene city("city", 500.0);
  EXPECT_GT(city.num_patches(), 10 * SyntheticScene("city", 100.0).num_patches());
  EXPECT_DOUBLE_EQ(city.bounds().sizes().x(), 500.0);
  EXPECT_LT(city.bounds().sizes().z(), 60.0);
}

TEST(SyntheticScene, AnswersNotANumberWhereThereIsNoPoint) {
  const SyntheticScene scene("box");
  EXPECT_TRUE(std::isnan(scene.distance(Vector3(NAN, 0, 0))));
  EXPECT_TRUE(std::isnan(scene.distance(Vector3(0, INFINITY, 0))));
}

TEST(SyntheticScene, NamesTheKnownScenesAndSizes) {
  const auto message_of = [](const char* name, double size) -> std::string {
    try {
      const SyntheticScene scene(name, size);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kUsage);
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(message_of("castle", 0.0),
            "unknown scene 'castle'; the scenes are plane, sphere, box, room, city");
  EXPECT_EQ(message_of("room", 1.5), "scene 'room' can have sizes from 4 m to 1000 m, not 1.5 m");
  for (const double size : {-1.0, 1e9, static_cast<double>(NAN)}) {
    EXPECT_NE(message_of("city", size), "no error");
  }
}

}  // namespace
}  // namespace gdfmap
