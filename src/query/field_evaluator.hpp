#pragma once

#include <optional>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/query/distance_field.hpp>
#include <gdfmap/query/occupancy_index.hpp>

#include "tile_cursor.hpp"

namespace gdfmap {

/// What is the same for all queries of a field. Immutable, shared by its threads.
struct FieldModel {
  Lattice lattice;
  Geometry geometry;
  BlendMode blend;
  OccupancyIndex occupancy;
  bool has_cubes;
};

/// Answers queries one after the other. Not thread-safe: one for each thread.
class FieldEvaluator {
 public:
  /// Both outlive it.
  FieldEvaluator(const FieldModel& model, TileCache& cache) : model_(model), tiles_(cache) {}

  [[nodiscard]] FieldSample at(const Vector3& p_world);

 private:
  class Blend;
  /// Where a cube that can be evaluated is, or null, and whether its tile could be read.
  struct Found {
    bool readable = true;
    const DecodedTile* tile = nullptr;
    const DecodedTile::Cube* cube = nullptr;
  };

  [[nodiscard]] std::optional<FieldSample> partition(const Vector3& p_world, const CubeKey& own);
  [[nodiscard]] std::optional<FieldSample> gdf1(const Vector3& p_world, const CubeKey& own);
  /// Valid until a cube of another place is asked for, see TileCursor.
  [[nodiscard]] Found find(const CubeKey& key);
  [[nodiscard]] bool waits_for_training(const TileKey& tile);
  [[nodiscard]] bool add_level(const CubeKey& own, const Vector3& p_world, Blend& blend);

  const FieldModel& model_;
  TileCursor tiles_;
};

}  // namespace gdfmap
