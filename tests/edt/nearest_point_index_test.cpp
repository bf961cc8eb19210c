#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/edt/nearest_point_index.hpp>

namespace gdfmap {
namespace {

using Points = std::vector<NearestPointIndex::Point>;
using Samples = std::vector<Eigen::Vector3i>;

class Coordinates {
 public:
  explicit Coordinates(std::uint32_t seed) : generator_(seed) {}
  int operator()(int low, int high) {
    return low + static_cast<int>(generator_() % static_cast<unsigned>(high - low));
  }

 private:
  std::mt19937 generator_;
};

Points random_points(std::size_t count, std::uint32_t seed) {
  Coordinates next(seed);
  Points points(count);
  for (auto& p : points) {
    for (std::uint16_t& v : p) v = static_cast<std::uint16_t>(next(0, 65536));
  }
  return points;
}

Samples random_samples(std::size_t count, std::uint32_t seed, int low = -131072,
                       int high = 196608) {
  Coordinates next(seed);
  Samples samples(count);
  for (auto& s : samples) {
    for (int& v : s) v = next(low, high);
  }
  return samples;
}

/// Samples of a lattice, in packets of 4 × 4 × 4.
Samples lattice_samples(int spacing) {
  Samples samples;
  for (int packet = 0; packet < 27; ++packet) {
    for (int i = 0; i < 64; ++i) {
      samples.emplace_back(spacing * (packet / 9 * 4 + i / 16),
                           spacing * (packet / 3 % 3 * 4 + i / 4 % 4),
                           spacing * (packet % 3 * 4 + i % 4));
    }
  }
  return samples;
}

float brute_force(const Points& points, const Eigen::Vector3i& p) {
  float best = std::numeric_limits<float>::infinity();
  for (const auto& q : points) {
    const auto dx = static_cast<float>(q[0] - p.x()), dy = static_cast<float>(q[1] - p.y()),
               dz = static_cast<float>(q[2] - p.z());
    best = std::min(best, std::fma(dz, dz, std::fma(dy, dy, dx * dx)));
  }
  return best;
}

std::vector<float> best_of(const std::vector<SamplePacket>& packets) {
  std::vector<float> best;
  for (const SamplePacket& packet : packets) {
    best.insert(best.end(), packet.best_squared, packet.best_squared + packet.count);
  }
  return best;
}

/// For every instruction set, sample by sample and in packets, with the samples' origin in the
/// corner of the points' tile and far from it.
void expect_exact(const Points& points, const Samples& samples) {
  std::vector<float> expected;
  for (const Eigen::Vector3i& s : samples) expected.push_back(brute_force(points, s));
  for (const InstructionSet set :
       {InstructionSet::kPortable, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
    if (!is_supported(set)) continue;
    const NearestPointIndex index(points, set);
    for (const SampleOrder order : {SampleOrder::kScattered, SampleOrder::kPackets}) {
      for (const Eigen::Vector3i& corner :
           {Eigen::Vector3i(0, 0, 0), Eigen::Vector3i(65536, -131072, 1 << 20)}) {
        Samples moved = samples;
        for (Eigen::Vector3i& s : moved) s += corner;
        std::vector<SamplePacket> packets = make_packets(moved);
        index.update(packets, corner.cast<float>(), order);
        EXPECT_EQ(best_of(packets), expected) << name_of(set);
      }
    }
  }
}

TEST(NearestPointIndex, EqualsBruteForceForEveryNumberOfPoints) {
  for (const std::size_t count : {1u, 2u, 15u, 16u, 17u, 255u, 257u, 4097u, 20000u}) {
    expect_exact(random_points(count, static_cast<std::uint32_t>(count)), random_samples(300, 7));
  }
}

TEST(NearestPointIndex, EqualsBruteForceOnAPlane) {
  Points points = random_points(5000, 3);
  for (auto& p : points) p[2] = 1234;
  expect_exact(points, random_samples(300, 5, 0, 65536));
  expect_exact(points, lattice_samples(1024));
}

TEST(NearestPointIndex, EqualsBruteForceForPacketsOfALattice) {
  expect_exact(random_points(20000, 17), lattice_samples(1024));
  expect_exact(random_points(50, 18), lattice_samples(4096));
}

TEST(NearestPointIndex, SurvivesIdenticalPoints) {
  expect_exact(Points(1000, {5, 6, 7}), random_samples(50, 9, 0, 65536));
}

TEST(NearestPointIndex, DoesNotDependOnTheOrderOfPoints) {
  Points points = random_points(3000, 11);
  const Samples samples = random_samples(200, 13);
  expect_exact(points, samples);
  std::reverse(points.begin(), points.end());
  expect_exact(points, samples);
}

TEST(NearestPointIndex, OnlyLowersWhatIsAlreadyKnown) {
  const NearestPointIndex index(Points{{100, 100, 100}});
  const Samples samples = {{100, 100, 110}, {100, 100, 200}};
  for (const SampleOrder order : {SampleOrder::kScattered, SampleOrder::kPackets}) {
    std::vector<SamplePacket> packets = make_packets(samples);
    packets[0].best_squared[0] = 50.0f;
    packets[0].best_squared[1] = 1e6f;
    index.update(packets, Eigen::Vector3f::Zero(), order);
    EXPECT_EQ(best_of(packets), (std::vector{50.0f, 10000.0f}));
  }
}

TEST(NearestPointIndex, WithoutPointsChangesNothing) {
  const NearestPointIndex index(Points{});
  std::vector<SamplePacket> packets = make_packets(Samples{{0, 0, 0}, {1, 1, 1}});
  packets[0].best_squared[0] = 3.0f;
  index.update(packets, Eigen::Vector3f::Zero(), SampleOrder::kPackets);
  EXPECT_EQ(best_of(packets), (std::vector{3.0f, std::numeric_limits<float>::infinity()}));
}

}  // namespace
}  // namespace gdfmap
