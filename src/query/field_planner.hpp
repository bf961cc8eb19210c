#pragma once

#include <limits>
#include <optional>

#include <gdfmap/field/blending.hpp>
#include <gdfmap/field/gaussians.hpp>

#include "field_model.hpp"
#include "tile_cursor.hpp"

namespace gdfmap {

inline FieldSample no_answer(FieldStatus status) {
  constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
  return {kNotKnown, Vector3::Constant(kNotKnown), status, kNotKnown, kNotKnown};
}

/// Finds which cubes make the answer at a point, and with which weights. Not thread-safe: one for
/// each thread.
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
  [[nodiscard]] Found find(const CubeKey& key) {
    const CachedTile& cached = tiles_.get(tile_of(key));
    if (!cached.tile) return {cached.availability};
    return {cached.availability, cached.tile.get(),
            cached.tile->find_served(cube_index_in_tile(key))};
  }

  /// Looks up every tile that an answer at this point may want, on all levels.
  void request_tiles(const Vector3& p_world);

  /// Kernels stay valid until release(), which is due when this says so.
  [[nodiscard]] bool holds_many_tiles() const { return tiles_.num_replaced() >= kManyTiles; }
  void release() { tiles_.release(); }

  /// Calls `add(kernel, p_local, weight, weight_gradient)` for every cube of the partition of unity
  /// over all levels, Σ weight · d_c. What it returns is the answer without them: status, errors,
  /// and the far bound's part, or all of it where that is unknown.
  template <typename Add>
  [[nodiscard]] FieldSample plan(const Vector3& p_world, const Add& add);

 private:
  static constexpr std::size_t kManyTiles = 8;
  struct Blend;
  template <typename Add>
  [[nodiscard]] std::optional<FieldStatus> add_level(const CubeKey& own, const Vector3& p_world,
                                                     Blend& blend, const Add& add);
  [[nodiscard]] bool waits_for_training(const TileKey& tile);

  const FieldModel& model_;
  TileCursor tiles_;
};

/// d = Σ w·d_c + (1 − Σ w) · (the same of the next level), built from the finest level down.
/// `share` is what the finer levels have left to the present one, the product of their (1 − Σ w),
/// each taken as the sum over the missing cubes, so that it is exactly zero where none is.
struct FieldPlanner::Blend {
  double share = 1.0;
  Vector3 share_gradient = Vector3::Zero();
  double missing = 0.0;
  Vector3 missing_gradient = Vector3::Zero();
  double weight = 0.0;  ///< of the cubes so far
  double mae = 0.0, max_error = 0.0;

  void add_missing(const BlendTerm& term) {
    missing += term.weight;
    missing_gradient += term.weight_gradient;
  }
  void finish_level() {
    if (missing == 0.0) {
      share = 0.0;
      return;
    }
    share_gradient = share * missing_gradient + missing * share_gradient;
    share *= missing;
    missing = 0.0;
    missing_gradient.setZero();
  }
  [[nodiscard]] FieldSample answer(FieldStatus status, const FarBound& far) const {
    constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
    return {share * far.distance, share * far.gradient + far.distance * share_gradient, status,
            weight > 0.0 ? mae / weight : kNotKnown, max_error};
  }
};

template <typename Add>
FieldSample FieldPlanner::plan(const Vector3& p_world, const Add& add) {
  const std::optional<CubeKey> own = model_.lattice.cube_containing(p_world, 0);
  if (!own || !model_.has_cubes || waits_for_training(tile_of(*own))) {
    return no_answer(FieldStatus::kUnknown);
  }
  Blend blend;
  for (int level = 0; level < model_.geometry.num_levels; ++level) {
    const auto cube = level == 0 ? own : model_.lattice.cube_containing(p_world, level);
    if (!cube) return no_answer(FieldStatus::kUnknown);
    if (const auto reason = add_level(*cube, p_world, blend, add)) return no_answer(*reason);
    if (blend.share == 0.0) {
      return blend.answer(level == 0 ? FieldStatus::kFine : FieldStatus::kCoarse, {});
    }
  }
  const std::optional<FarBound> far = model_.occupancy.nearest(p_world);
  return far ? blend.answer(FieldStatus::kFar, *far) : no_answer(FieldStatus::kUnknown);
}

/// What is to be answered instead when a cube that is needed cannot be read, or not yet.
template <typename Add>
std::optional<FieldStatus> FieldPlanner::add_level(const CubeKey& own, const Vector3& p_world,
                                                   Blend& blend, const Add& add) {
  bool is_pending = false;
  const auto add_term = [&](const BlendTerm& term) {
    const Found found = find(term.cube);
    if (found.availability == TileAvailability::kUnreadable) return false;
    if (found.availability == TileAvailability::kPending) {
      is_pending = true;  // go on: all tiles that are needed shall be asked for
      return true;
    }
    if (found.cube == nullptr) {
      blend.add_missing(term);
      return true;
    }
    double weight = term.weight;
    if (blend.share == 1.0) {  // and its gradient zero: the finer levels have nothing here
      add(found.tile->kernel(*found.cube), term.p_local, weight, term.weight_gradient);
    } else {
      weight *= blend.share;
      add(found.tile->kernel(*found.cube), term.p_local, weight,
          Vector3(blend.share * term.weight_gradient + term.weight * blend.share_gradient));
    }
    blend.weight += weight;
    blend.mae += weight * static_cast<double>(found.cube->mae);
    blend.max_error += weight * static_cast<double>(found.cube->max_error);
    return true;
  };
  if (!visit_partition_of_unity(own, p_world, model_.lattice.cube_edge(own.level),
                                model_.margins[static_cast<std::size_t>(own.level)], add_term)) {
    return FieldStatus::kUnknown;
  }
  if (is_pending) return FieldStatus::kPending;
  blend.finish_level();
  return std::nullopt;
}

inline bool FieldPlanner::waits_for_training(const TileKey& tile) {
  const CachedTile& cached = tiles_.get(tile);
  if (cached.tile && cached.tile->num_cubes() > 0) return false;
  // add_level() sees to tiles that cannot be read, or not yet.
  const bool is_known = cached.availability == TileAvailability::kAbsent ||
                        cached.availability == TileAvailability::kLoaded;
  return is_known && model_.occupancy.is_occupied(tile);
}

inline void FieldPlanner::request_tiles(const Vector3& p_world) {
  for (int level = 0; level < model_.geometry.num_levels; ++level) {
    const std::optional<CubeKey> own = model_.lattice.cube_containing(p_world, level);
    if (!own) return;
    visit_partition_of_unity(*own, p_world, model_.lattice.cube_edge(level),
                             model_.margins[static_cast<std::size_t>(level)],
                             [this](const BlendTerm& term) {
                               static_cast<void>(tiles_.get(tile_of(term.cube)));
                               return true;
                             });
  }
}

}  // namespace gdfmap
