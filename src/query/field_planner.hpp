#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <gdfmap/field/blending.hpp>

#include "field_kernels.hpp"
#include "field_model.hpp"
#include "locality_order.hpp"
#include "tile_cursor.hpp"

namespace gdfmap {

/// What answers the points of a zone: on each level, as far as finer ones leave something to it,
/// the cubes that share them.
struct FieldPlan {
  std::size_t num_levels = 0;
  std::array<BlendZone, kMaxLevels> zones;
  std::array<KernelLevel, kMaxLevels> levels;
  /// The minimum corner of the first cube of each level, metres.
  std::array<std::array<double, 3>, kMaxLevels> corners;
  /// No cube of the last level is missing, so that nothing is left to the far bound.
  bool is_whole = false;
  /// Unless it is whole: bit i is set when cube i of levels[0] holds points, where the far bound is
  /// zero.
  std::uint8_t occupied = 0;
  /// Answered instead, where nothing is known, or not yet.
  std::optional<FieldStatus> no_answer;
  /// Set when the plan is good for the points of this level-0 tile alone.
  std::optional<TileKey> only_tile;
};

/// Finds which cubes make the answer at a point. Not thread-safe: one for each thread.
class FieldPlanner {
 public:
  /// All outlive it. @param loader  see TileCursor
  FieldPlanner(const FieldModel& model, TileCache& cache, TileLoader* loader)
      : model_(model), tiles_(cache, loader) {}

  /// Where a cube that can be evaluated is, or null, and what became of its tile.
  struct Found {
    TileAvailability availability = TileAvailability::kAbsent;
    const DecodedTile* tile = nullptr;
    const DecodedTile::Cube* cube = nullptr;
  };
  /// Valid until a cube of another place is asked for, its tile until release().
  [[nodiscard]] Found find(const CubeKey& key);

  /// The plan of a point; its kernels stay valid until release(), which is due when
  /// holds_many_tiles() says so.
  void make_plan(const Vector3& p_world, FieldPlan& plan);
  /// The plan is that of this point as well.
  /// @param zone_0  how the point's zone of level 0 differs from the plan's
  [[nodiscard]] bool holds(const FieldPlan& plan, const Vector3& p_world, ZoneChange zone_0) const;

  /// Looks up every tile that an answer at this point may want, on all levels.
  void request_tiles(const Vector3& p_world);

  [[nodiscard]] bool holds_many_tiles() const { return tiles_.num_replaced() >= kManyTiles; }
  void release() { tiles_.release(); }

 private:
  static constexpr std::size_t kManyTiles = 8;

  void add_level(const BlendZone& zone, const Vector3& p_world, FieldPlan& plan);
  [[nodiscard]] std::uint8_t occupied_cubes(const BlendZone& zone) const;
  /// Says in the plan what the state of a tile means for the points of this zone.
  void consider(const TileKey& tile, const CachedTile& cached, const Vector3& p_world,
                FieldPlan& plan) const;
  [[nodiscard]] std::optional<TileKey> own_tile(const Vector3& p_world) const;

  const FieldModel& model_;
  TileCursor tiles_;
};

}  // namespace gdfmap
