#include "tile_samples.hpp"

#include <algorithm>
#include <array>

namespace gdfmap {
namespace {

constexpr int kSide = kTileSamplesPerAxis;
/// Samples are looked up in packets of 4 × 4 × 4, so that neighbours in space follow each other.
constexpr int kPacket = 4;
static_assert(kSide % kPacket == 0);

std::size_t lattice_index(int x, int y, int z) {
  return (static_cast<std::size_t>(x) * kSide + static_cast<std::size_t>(y)) * kSide +
         static_cast<std::size_t>(z);
}

std::array<int, 3> cube_coordinates(int index) {
  constexpr int n = kCubesPerTileAxis;
  return {index % n, index / n % n, index / (n * n)};
}

/// Calls visit(x, y, z) for every sample of the tile's lattice, packet by packet.
template <typename Visit>
void for_each_in_packets(const Visit& visit) {
  constexpr int kPackets = kSide / kPacket;
  for (int packet = 0; packet < kPackets * kPackets * kPackets; ++packet) {
    const int px = packet / (kPackets * kPackets), py = packet / kPackets % kPackets,
              pz = packet % kPackets;
    for (int i = 0; i < kPacket * kPacket * kPacket; ++i) {
      visit(px * kPacket + i / (kPacket * kPacket), py * kPacket + i / kPacket % kPacket,
            pz * kPacket + i % kPacket);
    }
  }
}

/// Calls visit(x, y, z) for the samples of one cube, in the order of its targets.
template <typename Visit>
void for_each_of_cube(int cube, const Visit& visit) {
  const auto [cx, cy, cz] = cube_coordinates(cube);
  for (int x = 0; x < kSamplesPerAxis; ++x) {
    for (int y = 0; y < kSamplesPerAxis; ++y) {
      for (int z = 0; z < kSamplesPerAxis; ++z) {
        visit(cx * kSamplesPerEdge + x, cy * kSamplesPerEdge + y, cz * kSamplesPerEdge + z);
      }
    }
  }
}

}  // namespace

TileSamples::TileSamples(const TileKey& key, const CubeMask& populated, const Lattice& lattice,
                         const FitConfig& config, ExactDistance& exact_distance, int num_threads)
    : key_(key),
      step_(lattice.step()),
      exact_distance_(&exact_distance),
      num_threads_(num_threads) {
  select_cubes(populated,
               config.empty_distance_threshold * static_cast<double>(level_scale(key.level)));
  look_up_targets();
  look_up_held_out();
}

std::vector<float> TileSamples::distances(std::span<const Eigen::Vector3i> samples) const {
  const std::vector<double> steps =
      exact_distance_->nearest(tile_origin(key_), samples, num_threads_);
  std::vector<float> metres(steps.size());
  std::transform(steps.begin(), steps.end(), metres.begin(),
                 [this](double d) { return static_cast<float>(d * step_); });
  return metres;
}

void TileSamples::select_cubes(const CubeMask& populated, double threshold) {
  const auto edge = static_cast<int>(steps_per_cube(key_.level));
  std::vector<Eigen::Vector3i> centres;
  for (int i = 0; i < kCubesPerTile; ++i) {
    const auto [x, y, z] = cube_coordinates(i);
    centres.emplace_back(x * edge + edge / 2, y * edge + edge / 2, z * edge + edge / 2);
  }
  const std::vector<float> distance = distances(centres);
  for (int i = 0; i < kCubesPerTile; ++i) {
    if (populated.test(i) || distance[static_cast<std::size_t>(i)] <= threshold)
      cubes_.push_back(i);
  }
}

void TileSamples::look_up_targets() {
  std::vector<bool> needed(lattice_index(kSide - 1, kSide - 1, kSide - 1) + 1);
  for (const int cube : cubes_) {
    for_each_of_cube(cube, [&](int x, int y, int z) { needed[lattice_index(x, y, z)] = true; });
  }
  std::vector<Eigen::Vector3i> samples;
  std::vector<std::size_t> places;
  for_each_in_packets([&](int x, int y, int z) {
    if (!needed[lattice_index(x, y, z)]) return;
    const auto offset = [&](int i) { return static_cast<int>(sample_offset(i, key_.level)); };
    samples.emplace_back(offset(x), offset(y), offset(z));
    places.push_back(lattice_index(x, y, z));
  });
  const std::vector<float> found = distances(samples);
  targets_.resize(needed.size());
  for (std::size_t i = 0; i < places.size(); ++i) targets_[places[i]] = found[i];
}

void TileSamples::look_up_held_out() {
  const auto edge = static_cast<int>(steps_per_cube(key_.level));
  std::vector<Eigen::Vector3i> samples;
  samples.reserve(cubes_.size() * kNumHeldOut);
  for (const int cube : cubes_) {
    const auto [cx, cy, cz] = cube_coordinates(cube);
    const auto offset = [&](int c, int i) {
      return c * edge + static_cast<int>(held_out_offset(i, key_.level));
    };
    for (int x = 0; x < kHeldOutPerAxis; ++x) {
      for (int y = 0; y < kHeldOutPerAxis; ++y) {
        for (int z = 0; z < kHeldOutPerAxis; ++z) {
          samples.emplace_back(offset(cx, x), offset(cy, y), offset(cz, z));
        }
      }
    }
  }
  held_out_ = distances(samples);
}

void TileSamples::copy_targets(std::size_t n, std::span<float, kNumSamples> targets) const {
  std::size_t i = 0;
  for_each_of_cube(cubes_[n],
                   [&](int x, int y, int z) { targets[i++] = targets_[lattice_index(x, y, z)]; });
}

}  // namespace gdfmap
