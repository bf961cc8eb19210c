#include "evaluation_domain.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <gdfmap/core/error.hpp>
#include <gdfmap/edt/sample_lattice.hpp>
#include <gdfmap/pipeline/evaluate.hpp>

namespace gdfmap {
namespace {

/// Numbers that one place takes of a seed's sequence: which box, and where in it along each axis.
constexpr std::uint64_t kNumbersPerPlace = 4;
/// Regions that sequences are kept apart for.
constexpr std::uint64_t kMaxRegions = kMaxLevels + 1;

/// Index of the set bit that has `rank` set bits below it.
int nth_cube(const CubeMask& mask, std::uint64_t rank) {
  for (int i = 0; i < kCubesPerTile; ++i) {
    if (mask.test(i) && rank-- == 0) return i;
  }
  throw Error(ErrorCode::kInternal, "a cube mask has fewer cubes than were counted");
}

LatticePoint corner_of(const CubeKey& cube) {
  const std::int64_t edge = steps_per_cube(cube.level);
  return {cube.x * edge, cube.y * edge, cube.z * edge};
}

/// How many tiles long a cell is: about half of the distance that cells are wanted within, so that
/// few cells hold little that is not.
std::int64_t tiles_per_cell(const Lattice& lattice) {
  const double tile = lattice.cube_size() * kCubesPerTileAxis;
  return std::max<std::int64_t>(1, std::llround(0.5 * kMaxJudgedDistance / tile));
}

/// Corners of the cells that may hold places within kMaxJudgedDistance of a point.
std::vector<LatticePoint> cells_around(std::span<const OccupiedTile> occupied,
                                       const Lattice& lattice) {
  const std::int64_t tiles = tiles_per_cell(lattice);
  std::set<LatticePoint> own;
  for (const OccupiedTile& tile : occupied) {
    own.insert(
        {floor_div(tile.key.x, tiles), floor_div(tile.key.y, tiles), floor_div(tile.key.z, tiles)});
  }
  const double edge = lattice.cube_size() * kCubesPerTileAxis * static_cast<double>(tiles);
  const auto reach = static_cast<std::int64_t>(std::ceil(kMaxJudgedDistance / edge));
  const auto gap = [&](std::int64_t d) {
    return edge * static_cast<double>(std::max<std::int64_t>(0, std::abs(d) - 1));
  };
  std::set<LatticePoint> around;
  for (const LatticePoint& cell : own) {
    for (std::int64_t x = -reach; x <= reach; ++x) {
      for (std::int64_t y = -reach; y <= reach; ++y) {
        for (std::int64_t z = -reach; z <= reach; ++z) {
          if (Vector3(gap(x), gap(y), gap(z)).norm() > kMaxJudgedDistance) continue;
          around.insert({cell.x + x, cell.y + y, cell.z + z});
        }
      }
    }
  }
  std::vector<LatticePoint> corners;
  const std::int64_t steps = tiles * kStepsPerTileAxis;
  for (const LatticePoint& cell : around) {
    corners.push_back({cell.x * steps, cell.y * steps, cell.z * steps});
  }
  return corners;
}

}  // namespace

std::uint64_t random_bits(std::uint64_t seed, std::uint64_t counter) {
  const auto mix = [](std::uint64_t v) {
    v += 0x9e3779b97f4a7c15u;
    v = (v ^ v >> 30) * 0xbf58476d1ce4e5b9u;
    v = (v ^ v >> 27) * 0x94d049bb133111ebu;
    return v ^ v >> 31;
  };
  return mix(mix(seed) ^ mix(counter));
}

CubeKey cube_at_level(const LatticePoint& p, int level) {
  const std::int64_t edge = steps_per_cube(level);
  return {level, floor_div(p.x, edge), floor_div(p.y, edge), floor_div(p.z, edge)};
}

JudgedTile judged_tile(const TileRecord& record, bool skip_poor) {
  JudgedTile tile{record.key, {}, {}, {}};
  for (const CubeRecord& cube : record.cubes) {
    if (cube.status == CubeStatus::kFailed) continue;
    if (skip_poor && cube.status == CubeStatus::kPoor) continue;
    tile.cubes.set(cube.index);
    if (cube.cube_class == CubeClass::kPopulated) tile.populated.set(cube.index);
  }
  return tile;
}

JudgedLevel::JudgedLevel(int level, std::vector<JudgedTile> tiles)
    : level_(level), tiles_(std::move(tiles)) {
  for (const JudgedTile& tile : tiles_) {
    by_key_.emplace(tile.key, first_cube_.size());
    first_cube_.push_back(num_cubes_);
    num_cubes_ += static_cast<std::uint64_t>(tile.cubes.count());
  }
  mark_outer_shell();
}

void JudgedLevel::mark_outer_shell() {
  const auto lacks_a_neighbour = [&](const CubeKey& cube) {
    for (int n = 0; n < 27; ++n) {
      if (!holds({cube.level, cube.x + n % 3 - 1, cube.y + n / 3 % 3 - 1, cube.z + n / 9 - 1})) {
        return true;
      }
    }
    return false;
  };
  for (JudgedTile& tile : tiles_) {
    for (int i = 0; i < kCubesPerTile; ++i) {
      if (tile.cubes.test(i) && lacks_a_neighbour(cube_at(tile.key, i))) tile.outer_shell.set(i);
    }
  }
}

CubeKey JudgedLevel::cube(std::uint64_t n) const {
  const auto after = std::upper_bound(first_cube_.begin(), first_cube_.end(), n);
  const auto tile = static_cast<std::size_t>(after - first_cube_.begin() - 1);
  return cube_at(tiles_[tile].key, nth_cube(tiles_[tile].cubes, n - first_cube_[tile]));
}

bool JudgedLevel::holds(const CubeKey& cube) const {
  const JudgedTile* const tile = find(tile_of(cube));
  return tile != nullptr && tile->cubes.test(cube_index_in_tile(cube));
}

const JudgedTile* JudgedLevel::find(const TileKey& key) const {
  const auto found = by_key_.find(key);
  return found == by_key_.end() ? nullptr : &tiles_[found->second];
}

EvaluationDomain::EvaluationDomain(std::span<const JudgedLevel> levels,
                                   std::span<const OccupiedTile> occupied, const Lattice& lattice)
    : levels_(levels),
      lattice_(lattice),
      cell_steps_(tiles_per_cell(lattice) * kStepsPerTileAxis),
      cells_(cells_around(occupied, lattice)) {}

int EvaluationDomain::level(std::size_t region) const {
  return region < levels_.size() ? levels_[region].level() : kNoLevel;
}

int EvaluationDomain::level_at(const LatticePoint& p) const {
  for (const JudgedLevel& level : levels_) {
    if (level.holds(cube_at_level(p, level.level()))) return level.level();
  }
  return kNoLevel;
}

double EvaluationDomain::drawn_volume(std::size_t region) const {
  const auto volume = [](double edge, double count) { return edge * edge * edge * count; };
  if (region < levels_.size()) {
    return volume(lattice_.cube_edge(levels_[region].level()),
                  static_cast<double>(levels_[region].num_cubes()));
  }
  return volume(static_cast<double>(cell_steps_) * lattice_.step(),
                static_cast<double>(cells_.size()));
}

std::optional<LatticePoint> EvaluationDomain::draw(std::size_t region, std::uint64_t seed,
                                                   std::uint64_t i) const {
  const std::uint64_t first = (i * kMaxRegions + region) * kNumbersPerPlace;
  const auto number = [&](std::uint64_t n, std::uint64_t end) {
    return random_bits(seed, first + n) % end;
  };
  LatticePoint p;
  std::int64_t edge = cell_steps_;
  if (region < levels_.size()) {
    const CubeKey cube = levels_[region].cube(number(0, levels_[region].num_cubes()));
    p = corner_of(cube);
    edge = steps_per_cube(cube.level);
  } else {
    p = cells_[number(0, cells_.size())];
  }
  const auto offset = [&](std::uint64_t n) {
    return static_cast<std::int64_t>(number(n, static_cast<std::uint64_t>(edge)));
  };
  p = {p.x + offset(1), p.y + offset(2), p.z + offset(3)};
  if (level_at(p) != level(region)) return std::nullopt;
  return p;
}

}  // namespace gdfmap
