#include "evaluation_samples.hpp"

#include <algorithm>
#include <array>
#include <unordered_map>

#include <gdfmap/core/error.hpp>
#include <gdfmap/edt/sample_lattice.hpp>

namespace gdfmap {
namespace {

/// SplitMix64's finaliser (Steele, Lea, Flood 2014).
std::uint64_t mix(std::uint64_t v) {
  v += 0x9e3779b97f4a7c15u;
  v = (v ^ v >> 30) * 0xbf58476d1ce4e5b9u;
  v = (v ^ v >> 27) * 0x94d049bb133111ebu;
  return v ^ v >> 31;
}

/// Number `dimension` of sample i of a seed's sequence.
std::uint64_t random_bits(std::uint64_t seed, std::uint64_t i, std::uint64_t dimension) {
  return mix(mix(seed) ^ mix(4 * i + dimension));
}

/// Index of the set bit that has `rank` set bits below it.
int nth_cube(const CubeMask& mask, std::uint64_t rank) {
  for (int i = 0; i < kCubesPerTile; ++i) {
    if (mask.test(i) && rank-- == 0) return i;
  }
  throw Error(ErrorCode::kInternal, "a cube mask has fewer cubes than were counted");
}

Eigen::Vector3i corner_in_tile(int cube) {
  constexpr int n = kCubesPerTileAxis;
  return Eigen::Vector3i(cube % n, cube / n % n, cube / (n * n)) * kStepsPerCubeAxis;
}

Vector3 to_world(const TileKey& tile, const Eigen::Vector3i& p_tile, const Lattice& lattice) {
  const LatticePoint origin = tile_origin(tile);
  return lattice.to_world({origin.x + p_tile.x(), origin.y + p_tile.y(), origin.z + p_tile.z()});
}

}  // namespace

void add_judged_tile(const TileRecord& record, bool skip_poor, std::vector<JudgedTile>& tiles) {
  JudgedTile tile{record.key, {}, {}, {}};
  for (const CubeRecord& cube : record.cubes) {
    if (cube.status == CubeStatus::kFailed) continue;
    if (skip_poor && cube.status == CubeStatus::kPoor) continue;
    tile.cubes.set(cube.index);
    if (cube.cube_class == CubeClass::kPopulated) tile.populated.set(cube.index);
  }
  if (tile.cubes.any()) tiles.push_back(tile);
}

void mark_outer_shell(std::vector<JudgedTile>& tiles) {
  std::unordered_map<TileKey, const CubeMask*, TileKeyHash> masks;
  for (const JudgedTile& tile : tiles) masks.emplace(tile.key, &tile.cubes);
  const auto has_cube = [&](const CubeKey& cube) {
    const auto found = masks.find(tile_of(cube));
    return found != masks.end() && found->second->test(cube_index_in_tile(cube));
  };
  for (JudgedTile& tile : tiles) {
    for (int i = 0; i < kCubesPerTile; ++i) {
      if (!tile.cubes.test(i)) continue;
      const CubeKey cube = cube_at(tile.key, i);
      for (int n = 0; n < 27; ++n) {
        if (has_cube(
                {cube.level, cube.x + n % 3 - 1, cube.y + n / 3 % 3 - 1, cube.z + n / 9 - 1})) {
          continue;
        }
        tile.outer_shell.set(i);
        break;
      }
    }
  }
}

RandomSampler::RandomSampler(const std::vector<JudgedTile>& tiles, std::uint64_t num_samples,
                             std::uint64_t seed)
    : tiles_(tiles), seed_(seed), of_tile_(tiles.size()) {
  for (const JudgedTile& tile : tiles) {
    first_cube_.push_back(num_cubes_);
    num_cubes_ += static_cast<std::uint64_t>(tile.cubes.count());
  }
  if (num_cubes_ == 0) return;
  for (std::uint64_t i = 0; i < num_samples; ++i) {
    const std::uint64_t cube = random_bits(seed_, i, 0) % num_cubes_;
    const auto after = std::upper_bound(first_cube_.begin(), first_cube_.end(), cube);
    of_tile_[static_cast<std::size_t>(after - first_cube_.begin() - 1)].push_back(i);
  }
}

std::vector<JudgedSample> RandomSampler::samples(std::size_t tile, const Lattice& lattice) const {
  std::vector<JudgedSample> result;
  result.reserve(of_tile_[tile].size());
  for (const std::uint64_t i : of_tile_[tile]) {
    const std::uint64_t rank = random_bits(seed_, i, 0) % num_cubes_ - first_cube_[tile];
    const int cube = nth_cube(tiles_[tile].cubes, rank);
    Eigen::Vector3i p_tile = corner_in_tile(cube);
    for (int a = 0; a < 3; ++a) {
      p_tile[a] += static_cast<int>(random_bits(seed_, i, static_cast<std::uint64_t>(a) + 1) %
                                    kStepsPerCubeAxis);
    }
    result.push_back({cube, to_world(tiles_[tile].key, p_tile, lattice), p_tile});
  }
  return result;
}

std::vector<JudgedSample> regular_samples(const JudgedTile& tile, double step,
                                          const Lattice& lattice) {
  const double edge = lattice.cube_edge(tile.key.level);
  std::vector<double> offsets;
  for (double offset = step / 2; offset < edge; offset += step) offsets.push_back(offset);
  std::vector<JudgedSample> result;
  for (int cube = 0; cube < kCubesPerTile; ++cube) {
    if (!tile.cubes.test(cube)) continue;
    const Eigen::Vector3i corner = corner_in_tile(cube);
    const Vector3 origin = lattice.cube_origin(cube_at(tile.key, cube));
    for (const double x : offsets) {
      for (const double y : offsets) {
        for (const double z : offsets) {
          const Vector3 local(x, y, z);
          const Eigen::Vector3i rounded =
              (local / lattice.step()).array().round().matrix().cast<int>();
          result.push_back({cube, origin + local, corner + rounded});
        }
      }
    }
  }
  return result;
}

}  // namespace gdfmap
