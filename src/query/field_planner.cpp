#include "field_planner.hpp"

namespace gdfmap {
namespace {

constexpr std::size_t kFloatsPerCacheLine = 16;
/// Of a cube, from its first row on: all of 8 Gaussians; the processor sees where more are going.
constexpr std::size_t kPrefetchedFloats = kNumGaussianRows * DecodedTile::kAlignedFloats;

KernelCube kernel_of(const DecodedTile& tile, const DecodedTile::Cube& cube) {
  const KernelView kernel = tile.kernel(cube);
  for (std::size_t i = 0; i < kPrefetchedFloats; i += kFloatsPerCacheLine) {
    __builtin_prefetch(kernel.data + i);
  }
  return {kernel.data, static_cast<std::uint32_t>(kernel.stride), cube.count, cube.mae,
          cube.max_error};
}

}  // namespace

FieldPlanner::Found FieldPlanner::find(const CubeKey& key) {
  const CachedTile& cached = tiles_.get(tile_of(key));
  if (!cached.tile) return {cached.availability};
  return {cached.availability, cached.tile.get(),
          cached.tile->find_served(cube_index_in_tile(key))};
}

bool FieldPlanner::holds(const FieldPlan& plan, const Vector3& p_world, ZoneChange zone_0) const {
  if (plan.num_levels == 0 || zone_0 == ZoneChange::kOther) return false;
  for (std::size_t level = zone_0 == ZoneChange::kNone ? 1 : 0; level < plan.num_levels; ++level) {
    const std::optional<BlendZone> zone = model_.zones[level].zone_of(p_world);
    if (!zone || !(*zone == plan.zones[level])) return false;
  }
  return !plan.only_tile || plan.only_tile == own_tile(p_world);
}

void FieldPlanner::make_plan(const Vector3& p_world, FieldPlan& plan) {
  plan.num_levels = 0;
  plan.is_whole = false;
  plan.no_answer.reset();
  plan.only_tile.reset();
  plan.occupied = 0;
  if (!model_.has_cubes) plan.no_answer = FieldStatus::kUnknown;
  const auto num_levels = static_cast<std::size_t>(model_.geometry.num_levels);
  while (plan.num_levels < num_levels && !plan.is_whole && !plan.no_answer) {
    if (const auto zone = model_.zones[plan.num_levels].zone_of(p_world)) {
      add_level(*zone, p_world, plan);
    } else {
      plan.no_answer = FieldStatus::kUnknown;
    }
  }
  if (!plan.is_whole && !plan.no_answer) plan.occupied = occupied_cubes(plan.zones[0]);
}

std::uint8_t FieldPlanner::occupied_cubes(const BlendZone& zone) const {
  unsigned bits = 0, bit = 1;
  visit_cubes(zone, [&](const CubeKey& key) {
    const CubeMask* const cubes = model_.occupancy.find(tile_of(key));
    if (cubes != nullptr && cubes->test(cube_index_in_tile(key))) bits |= bit;
    bit <<= 1;
  });
  return static_cast<std::uint8_t>(bits);
}

void FieldPlanner::add_level(const BlendZone& zone, const Vector3& p_world, FieldPlan& plan) {
  KernelLevel& level = plan.levels[plan.num_levels];
  level.edge = model_.zones[plan.num_levels].edge();
  level.margin = model_.zones[plan.num_levels].margin();
  for (std::size_t a = 0; a < 3; ++a) {
    level.counts[a] = static_cast<std::uint8_t>(BlendZone::num_cubes(zone.half_cubes[a]));
    plan.corners[plan.num_levels][a] =
        static_cast<double>(BlendZone::first_cube(zone.half_cubes[a])) * level.edge;
  }
  plan.zones[plan.num_levels++] = zone;
  plan.is_whole = true;
  KernelCube* next = level.cubes;
  TileKey tile;
  const CachedTile* cached = nullptr;
  visit_cubes(zone, [&](const CubeKey& key) {
    if (const TileKey tile_of_cube = tile_of(key); cached == nullptr || tile != tile_of_cube) {
      tile = tile_of_cube;
      cached = &tiles_.get(tile);
      if (!cached->tile || cached->tile->num_cubes() == 0) consider(tile, *cached, p_world, plan);
    }
    const DecodedTile::Cube* const cube =
        cached->tile ? cached->tile->find_served(cube_index_in_tile(key)) : nullptr;
    plan.is_whole &= cube != nullptr;
    *next++ = cube == nullptr ? KernelCube() : kernel_of(*cached->tile, *cube);
  });
}

void FieldPlanner::consider(const TileKey& tile, const CachedTile& cached, const Vector3& p_world,
                            FieldPlan& plan) const {
  if (cached.availability == TileAvailability::kUnreadable) {
    plan.no_answer = FieldStatus::kUnknown;
  } else if (cached.availability == TileAvailability::kPending) {
    // Nothing ends here: all tiles that are needed shall be asked for.
    if (!plan.no_answer) plan.no_answer = FieldStatus::kPending;
  } else if (tile.level == 0 && model_.occupancy.find(tile) != nullptr) {
    // It holds points and waits for its cubes: nothing is known of what lies in it.
    plan.only_tile = own_tile(p_world);
    if (plan.only_tile == tile) plan.no_answer = FieldStatus::kUnknown;
  }
}

std::optional<TileKey> FieldPlanner::own_tile(const Vector3& p_world) const {
  const std::optional<CubeKey> own = model_.lattice.cube_containing(p_world, 0);
  return own ? std::optional(tile_of(*own)) : std::nullopt;
}

void FieldPlanner::request_tiles(const Vector3& p_world) {
  for (std::size_t level = 0; level < static_cast<std::size_t>(model_.geometry.num_levels);
       ++level) {
    const std::optional<BlendZone> zone = model_.zones[level].zone_of(p_world);
    if (!zone) return;
    visit_cubes(*zone, [this](const CubeKey& key) { static_cast<void>(tiles_.get(tile_of(key))); });
  }
}

}  // namespace gdfmap
