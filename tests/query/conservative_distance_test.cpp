// How far the conservative distance can be trusted, on trained maps of analytic scenes.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/pipeline/field_access.hpp>
#include <gdfmap/pipeline/synthetic_scene.hpp>
#include <gdfmap/query/distance_field.hpp>
#include <gdfmap/train/exact_distance.hpp>
#include <gdfmap/train/train.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

/// Points in and around a box, on the lattice, where exact distances can be asked for: some near it
/// and some as far as coarse cubes answer.
std::vector<LatticePoint> points_around(const Box3& box, const Lattice& lattice) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<LatticePoint> points(150'000);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double margin = i % 3 == 0 ? 30.0 : 1.5;
    const Vector3 part(uniform(random), uniform(random), uniform(random));
    const Vector3 p_world = box.min() - Vector3::Constant(margin) +
                            part.cwiseProduct(box.sizes() + Vector3::Constant(2.0 * margin));
    points[i] = *lattice.quantize(p_world);
  }
  return points;
}

/// Distances to the nearest point of the map, metres.
std::vector<double> true_distances(Map& map, std::span<const LatticePoint> points) {
  std::vector<TilePoints> tiles;
  map.points().for_each_tile([&](const TilePoints& tile) { tiles.push_back(tile); });
  std::vector<Eigen::Vector3i> samples;
  for (const LatticePoint& p : points) {
    samples.emplace_back(static_cast<int>(p.x), static_cast<int>(p.y), static_cast<int>(p.z));
  }
  auto distances = ExactDistance(map.points(), tiles, std::size_t{1} << 28)
                       .nearest({0, 0, 0}, samples, SampleOrder::kScattered);
  for (double& d : distances) d *= Lattice(map.geometry().cube_size).step();
  return distances;
}

/// How often the conservative distance exceeds the true one, and how much it gives away; lengths as
/// parts of a scale.
struct Tally {
  std::size_t num_answers = 0;
  std::size_t num_exceeding = 0;
  double worst = 0.0;
  double given_away = 0.0;

  void add(double conservative, double truth, double scale) {
    ++num_answers;
    num_exceeding += conservative > truth;
    worst = std::max(worst, (conservative - truth) / scale);
    given_away += std::max(0.0, truth - conservative) / scale;
  }
  [[nodiscard]] double share() const {
    return static_cast<double>(num_exceeding) / static_cast<double>(num_answers);
  }
  [[nodiscard]] double mean_given_away() const {
    return given_away / static_cast<double>(num_answers);
  }
};

class ConservativeDistance : public ::testing::TestWithParam<const char*> {
 protected:
  void record(const std::string& name, const Tally& tally) {
    RecordProperty(name + "_num_answers", std::to_string(tally.num_answers));
    RecordProperty(name + "_share_exceeding", std::to_string(tally.share()));
    RecordProperty(name + "_worst_excess", std::to_string(tally.worst));
    RecordProperty(name + "_given_away", std::to_string(tally.mean_given_away()));
  }
};

TEST_P(ConservativeDistance, SeldomExceedsTheTrueDistanceAndByLittle) {
  const test::TemporaryDirectory directory;
  Map map = test::map_of(directory / "scene.gdfmap", test::scene_points(GetParam(), 300'000), 1.0,
                         kMaxLevels);
  train(map);
  const Lattice lattice(map.geometry().cube_size);
  const auto points = points_around(SyntheticScene(GetParam()).bounds(), lattice);
  const std::vector<double> truth = true_distances(map, points);
  std::vector<Vector3> points_world;
  for (const LatticePoint& p : points) points_world.push_back(lattice.to_world(p));
  std::vector<FieldSample> samples(points.size());
  DistanceField(open_tile_source(directory / "scene.gdfmap")).at(points_world, samples);

  Tally fine, coarse;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_NE(samples[i].status, FieldStatus::kUnknown);
    const double conservative = samples[i].conservative_distance();
    if (samples[i].status == FieldStatus::kFine) {
      fine.add(conservative, truth[i], 1.0);
    } else if (samples[i].status == FieldStatus::kCoarse) {
      coarse.add(conservative, truth[i], truth[i]);  // never near a point
    } else {
      ASSERT_LE(conservative, truth[i] + 1e-3) << points_world[i].transpose();
    }
  }
  record("fine", fine);
  record("coarse", coarse);
  EXPECT_GT(fine.num_answers, 10'000u);
  EXPECT_LT(fine.share(), 0.005);
  EXPECT_LT(fine.worst, 0.05);
  EXPECT_LT(fine.mean_given_away(), 0.06);
  EXPECT_GT(coarse.num_answers, 10'000u);
  EXPECT_LT(coarse.share(), 0.005);
  EXPECT_LT(coarse.worst, 0.05);
  EXPECT_LT(coarse.mean_given_away(), 0.08);
}

INSTANTIATE_TEST_SUITE_P(, ConservativeDistance, ::testing::Values("sphere", "room"),
                         [](const auto& scene) { return std::string(scene.param); });

}  // namespace
}  // namespace gdfmap
