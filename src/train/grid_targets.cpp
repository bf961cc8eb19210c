#include "grid_targets.hpp"

#include <algorithm>

#include "morton_grid.hpp"

namespace gdfmap {
namespace {

/// Samples are looked up in packets of 4 × 4 × 4, which a cube's samples fill exactly.
constexpr int kPacket = 4;
constexpr std::size_t kPacketSamples = kPacket * kPacket * kPacket;
static_assert(std::ranges::all_of(kTrainingGrids, [](const TrainingGrid& grid) {
  return grid.per_edge % kPacket == 0 && grid.per_axis() % kPacket == 0;
}));
/// Enough for one search to be worth its beginning, few enough to stand close together.
constexpr std::size_t kPacketsPerChunk = 16;

/// Packets along a tile: those of its cubes and one margin at either end.
int packets_per_side(const TrainingGrid& grid) {
  return (kCubesPerTileAxis * grid.per_edge + 2 * grid.margin) / kPacket;
}

/// Places of the packets of a tile in Morton order.
const std::vector<std::array<int, 3>>& packets_of_tile(const TrainingGrid& grid) {
  static const auto populated = morton_ordered_grid(packets_per_side(kPopulatedGrid));
  static const auto empty = morton_ordered_grid(packets_per_side(kEmptyGrid));
  return grid == kPopulatedGrid ? populated : empty;
}

/// Places of the packets that a cube and its margin take, from the first of them.
const std::vector<std::array<int, 3>>& packets_of_cube(const TrainingGrid& grid) {
  static const auto populated = morton_ordered_grid(kPopulatedGrid.per_axis() / kPacket);
  static const auto empty = morton_ordered_grid(kEmptyGrid.per_axis() / kPacket);
  return grid == kPopulatedGrid ? populated : empty;
}

/// The samples of a packet in the order of the search.
const std::vector<std::array<int, 3>>& places_in_packet() {
  static const auto places = upright_grid(kPacket);
  return places;
}

/// Of a sample within its packet.
std::size_t place_in_packet(int x, int y, int z) {
  return static_cast<std::size_t>((x * kPacket + y) * kPacket + z);
}

}  // namespace

GridTargets::GridTargets(const TrainingGrid& grid, int level, std::span<const int> cubes)
    : grid_(grid) {
  if (cubes.empty()) return;
  for (int i = 0; i < packets_per_side(grid) * kPacket; ++i) {
    offsets_.push_back(static_cast<int>(grid.offset(i, level)));
  }
  select_packets(cubes);
  targets_.resize(packets_.size() * kPacketSamples);
}

std::size_t GridTargets::packet_index(int x, int y, int z) const {
  const int side = packets_per_side(grid_);
  return static_cast<std::size_t>((x * side + y) * side + z);
}

void GridTargets::select_packets(std::span<const int> cubes) {
  const int per_edge = grid_.per_edge / kPacket;
  const auto& places = packets_of_tile(grid_);
  constexpr int kNotNeeded = -1, kNeeded = 0;
  slots_.assign(places.size(), kNotNeeded);
  for (const int cube : cubes) {
    const auto [cx, cy, cz] = cube_coordinates(cube);
    for (const auto& [x, y, z] : packets_of_cube(grid_)) {
      slots_[packet_index(cx * per_edge + x, cy * per_edge + y, cz * per_edge + z)] = kNeeded;
    }
  }
  for (const auto& place : places) {
    int& slot = slots_[packet_index(place[0], place[1], place[2])];
    if (slot == kNotNeeded) continue;
    slot = static_cast<int>(packets_.size());
    packets_.push_back(place);
  }
}

std::size_t GridTargets::num_chunks() const {
  return (packets_.size() + kPacketsPerChunk - 1) / kPacketsPerChunk;
}

std::span<const std::array<int, 3>> GridTargets::packets_of(std::size_t chunk) const {
  const std::size_t begin = chunk * kPacketsPerChunk;
  return std::span(packets_).subspan(begin, std::min(kPacketsPerChunk, packets_.size() - begin));
}

std::vector<Eigen::Vector3i> GridTargets::samples(std::size_t chunk) const {
  std::vector<Eigen::Vector3i> samples;
  samples.reserve(packets_of(chunk).size() * kPacketSamples);
  for (const std::array<int, 3>& packet : packets_of(chunk)) {
    const auto offset = [&](std::size_t axis, int place) {
      return offsets_[static_cast<std::size_t>(packet[axis] * kPacket + place)];
    };
    for (const auto& [x, y, z] : places_in_packet()) {
      samples.emplace_back(offset(0, x), offset(1, y), offset(2, z));
    }
  }
  return samples;
}

void GridTargets::keep(std::size_t chunk, std::span<const float> distances) {
  auto next = distances.begin();
  for (std::size_t i = 0; i < packets_of(chunk).size(); ++i) {
    const std::size_t packet = (chunk * kPacketsPerChunk + i) * kPacketSamples;
    for (const auto& [x, y, z] : places_in_packet()) {
      targets_[packet + place_in_packet(x, y, z)] = *next++;
    }
  }
}

std::vector<float> GridTargets::of_cube(int cube) const {
  const int per_axis = grid_.per_axis(), packets_per_edge = grid_.per_edge / kPacket;
  const auto [cx, cy, cz] = cube_coordinates(cube);
  std::vector<float> targets(grid_.size());
  for (const auto& [px, py, pz] : packets_of_cube(grid_)) {
    const int slot = slots_[packet_index(cx * packets_per_edge + px, cy * packets_per_edge + py,
                                         cz * packets_per_edge + pz)];
    const float* row = targets_.data() + static_cast<std::size_t>(slot) * kPacketSamples;
    for (int x = px * kPacket; x < (px + 1) * kPacket; ++x) {
      for (int y = py * kPacket; y < (py + 1) * kPacket; ++y, row += kPacket) {
        std::copy_n(row, kPacket, targets.data() + (x * per_axis + y) * per_axis + pz * kPacket);
      }
    }
  }
  return targets;
}

}  // namespace gdfmap
