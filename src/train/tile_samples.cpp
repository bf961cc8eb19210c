#include "tile_samples.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "morton_grid.hpp"

namespace gdfmap {
namespace {

constexpr int kSide = kTileSamplesPerAxis;
/// Samples are looked up in packets of 4 × 4 × 4, which a cube's samples fill exactly.
constexpr int kPacket = 4;
constexpr int kPacketsPerSide = kSide / kPacket;
static_assert(kSide % kPacket == 0 && kSamplesPerEdge % kPacket == 0 &&
              kSamplesPerAxis % kPacket == 0);
/// Enough for one search to be worth its beginning, few enough to stand close together.
constexpr std::size_t kPacketsPerChunk = 16;

constexpr std::size_t kPacketSamples = kPacket * kPacket * kPacket;

std::size_t packet_index(int x, int y, int z) {
  return static_cast<std::size_t>((x * kPacketsPerSide + y) * kPacketsPerSide + z);
}

/// Of a sample within its packet.
std::size_t place_in_packet(int x, int y, int z) {
  return static_cast<std::size_t>((x * kPacket + y) * kPacket + z);
}

}  // namespace

TileSamples::TileSamples(const TileKey& key, std::vector<int> cubes, const Lattice& lattice,
                         ExactDistance& exact_distance)
    : key_(key), step_(lattice.step()), exact_distance_(&exact_distance), cubes_(std::move(cubes)) {
  select_packets();
  targets_.resize(packets_.size() * kPacketSamples);
  held_out_.resize(cubes_.size() * kNumHeldOut);
}

std::vector<float> TileSamples::distances(std::span<const Eigen::Vector3i> samples) const {
  const std::vector<double> steps =
      exact_distance_->nearest(tile_origin(key_), samples, SampleOrder::kPackets);
  std::vector<float> metres(steps.size());
  std::transform(steps.begin(), steps.end(), metres.begin(),
                 [this](double d) { return static_cast<float>(d * step_); });
  return metres;
}

void TileSamples::select_packets() {
  constexpr int kPerEdge = kSamplesPerEdge / kPacket, kPerCube = kSamplesPerAxis / kPacket;
  static const auto places = morton_ordered_grid(kPacketsPerSide);
  static const auto of_cube = morton_ordered_grid(kPerCube);
  constexpr int kNotNeeded = -1, kNeeded = 0;
  slots_.assign(places.size(), kNotNeeded);
  for (const int cube : cubes_) {
    const auto [cx, cy, cz] = cube_coordinates(cube);
    for (const auto& [x, y, z] : of_cube) {
      slots_[packet_index(cx * kPerEdge + x, cy * kPerEdge + y, cz * kPerEdge + z)] = kNeeded;
    }
  }
  for (const auto& place : places) {
    int& slot = slots_[packet_index(place[0], place[1], place[2])];
    if (slot == kNotNeeded) continue;
    slot = static_cast<int>(packets_.size());
    packets_.push_back(place);
  }
}

std::size_t TileSamples::num_target_chunks() const {
  return (packets_.size() + kPacketsPerChunk - 1) / kPacketsPerChunk;
}

void TileSamples::look_up(std::size_t chunk) {
  if (chunk < num_target_chunks()) {
    look_up_targets(chunk);
  } else {
    look_up_held_out(chunk - num_target_chunks());
  }
}

void TileSamples::look_up_targets(std::size_t chunk) {
  static const auto places = morton_ordered_grid(kPacket);
  const std::size_t begin = chunk * kPacketsPerChunk;
  const std::size_t end = std::min(packets_.size(), begin + kPacketsPerChunk);
  std::vector<Eigen::Vector3i> samples;
  std::vector<std::size_t> targets;
  for (std::size_t i = begin; i < end; ++i) {
    for (const auto& place : places) {
      std::array<int, 3> at;
      for (std::size_t a = 0; a < 3; ++a) at[a] = packets_[i][a] * kPacket + place[a];
      const auto offset = [&](int n) { return static_cast<int>(sample_offset(n, key_.level)); };
      samples.emplace_back(offset(at[0]), offset(at[1]), offset(at[2]));
      targets.push_back(i * kPacketSamples + place_in_packet(place[0], place[1], place[2]));
    }
  }
  const std::vector<float> found = distances(samples);
  for (std::size_t i = 0; i < targets.size(); ++i) targets_[targets[i]] = found[i];
}

void TileSamples::look_up_held_out(std::size_t cube) {
  static const auto places = morton_ordered_grid(kHeldOutPerAxis);
  const auto edge = static_cast<int>(steps_per_cube(key_.level));
  const std::array<int, 3> corner = cube_coordinates(cubes_[cube]);
  std::vector<Eigen::Vector3i> samples;
  for (const auto& place : places) {
    Eigen::Vector3i sample;
    for (std::size_t a = 0; a < 3; ++a) {
      sample[static_cast<Eigen::Index>(a)] =
          corner[a] * edge + static_cast<int>(held_out_offset(place[a], key_.level));
    }
    samples.push_back(sample);
  }
  const std::vector<float> found = distances(samples);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& [x, y, z] = places[i];
    held_out_[cube * kNumHeldOut +
              static_cast<std::size_t>((x * kHeldOutPerAxis + y) * kHeldOutPerAxis + z)] = found[i];
  }
}

void TileSamples::copy_targets(std::size_t n, std::span<float, kNumSamples> targets) const {
  constexpr int kPerEdge = kSamplesPerEdge / kPacket, kPerCube = kSamplesPerAxis / kPacket;
  const auto [cx, cy, cz] = cube_coordinates(cubes_[n]);
  auto next = targets.begin();
  for (int x = 0; x < kSamplesPerAxis; ++x) {
    for (int y = 0; y < kSamplesPerAxis; ++y) {
      for (int packet = 0; packet < kPerCube; ++packet) {
        const int slot = slots_[packet_index(cx * kPerEdge + x / kPacket,
                                             cy * kPerEdge + y / kPacket, cz * kPerEdge + packet)];
        const std::size_t row = static_cast<std::size_t>(slot) * kPacketSamples +
                                place_in_packet(x % kPacket, y % kPacket, 0);
        next = std::copy_n(targets_.begin() + static_cast<std::ptrdiff_t>(row), kPacket, next);
      }
    }
  }
}

void TileSamples::copy_held_out(std::size_t n, std::span<float, kNumHeldOut> held_out) const {
  std::copy_n(held_out_.begin() + static_cast<std::ptrdiff_t>(n * kNumHeldOut), kNumHeldOut,
              held_out.begin());
}

}  // namespace gdfmap
