#include "field_evaluator.hpp"

#include <algorithm>
#include <limits>

#include <gdfmap/field/blending.hpp>
#include <gdfmap/field/gaussians.hpp>

namespace gdfmap {
namespace {

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
/// Shares below this are none: the ancestor's constant.
constexpr double kMinGdf1Weight = 1e-6;
/// Keeps the blending band of a model that states no margin from having no width.
constexpr double kMinMarginRatio = 1e-6;

FieldSample unknown_sample() {
  return {kNotKnown, Vector3::Constant(kNotKnown), FieldStatus::kUnknown, kNotKnown};
}

/// Σ w·(d_c, ∇d_c, mae) / Σ w.
class WeightedMean {
 public:
  void add(double weight, const ValueGradient& cube, double mae) {
    weight_ += weight;
    sum_.value += weight * cube.value;
    sum_.gradient += weight * cube.gradient;
    error_ += weight * mae;
  }
  [[nodiscard]] std::optional<FieldSample> sample() const {
    if (weight_ < kMinGdf1Weight) return std::nullopt;
    return FieldSample{sum_.value / weight_, sum_.gradient / weight_, FieldStatus::kFine,
                       error_ / weight_};
  }

 private:
  double weight_ = 0.0;
  ValueGradient sum_;
  double error_ = 0.0;
};

}  // namespace

/// d = Σ w·d_c + (1 − Σ w) · (the same of the next level), with its derivative, built from the
/// finest level down. `share` is what the finer levels have left to the present one, the product of
/// their (1 − Σ w), each taken as the sum over the missing cubes, so that it is exactly zero where
/// none is.
class FieldEvaluator::Blend {
 public:
  [[nodiscard]] bool is_complete() const { return share_ == 0.0; }

  void add_cube(const BlendTerm& term, const ValueGradient& cube, double mae) {
    const double weight = share_ * term.weight;
    add(weight, share_ * term.weight_gradient + term.weight * share_gradient_, cube);
    weight_ += weight;
    error_ += weight * mae;
  }
  void add_missing(const BlendTerm& term) {
    missing_ += term.weight;
    missing_gradient_ += term.weight_gradient;
  }
  void finish_level() {
    share_gradient_ = share_ * missing_gradient_ + missing_ * share_gradient_;
    share_ *= missing_;
    missing_ = 0.0;
    missing_gradient_.setZero();
  }
  void add_far(const FarBound& far) { add(share_, share_gradient_, {far.distance, far.gradient}); }

  [[nodiscard]] FieldSample sample(FieldStatus status) const {
    return {sum_.value, sum_.gradient, status, weight_ > 0.0 ? error_ / weight_ : kNotKnown};
  }

 private:
  void add(double weight, const Vector3& weight_gradient, const ValueGradient& term) {
    sum_.value += weight * term.value;
    sum_.gradient += weight * term.gradient + term.value * weight_gradient;
  }

  double share_ = 1.0;
  Vector3 share_gradient_ = Vector3::Zero();
  double missing_ = 0.0;
  Vector3 missing_gradient_ = Vector3::Zero();
  ValueGradient sum_;
  double weight_ = 0.0;  ///< of the cubes so far
  double error_ = 0.0;
};

FieldSample FieldEvaluator::at(const Vector3& p_world) {
  const std::optional<CubeKey> own = model_.lattice.cube_containing(p_world, 0);
  if (!own || !model_.has_cubes) return unknown_sample();
  const bool ours = model_.blend == BlendMode::kPartition;
  return (ours ? partition(p_world, *own) : gdf1(p_world, *own)).value_or(unknown_sample());
}

std::optional<FieldSample> FieldEvaluator::partition(const Vector3& p_world, const CubeKey& own) {
  if (waits_for_training(tile_of(own))) return std::nullopt;
  Blend blend;
  for (int level = 0; level < model_.geometry.num_levels; ++level) {
    const auto cube = level == 0 ? own : model_.lattice.cube_containing(p_world, level);
    if (!cube || !add_level(*cube, p_world, blend)) return std::nullopt;
    if (blend.is_complete()) {
      return blend.sample(level == 0 ? FieldStatus::kFine : FieldStatus::kCoarse);
    }
  }
  const std::optional<FarBound> far = model_.occupancy.nearest(p_world);
  if (!far) return std::nullopt;
  blend.add_far(*far);
  return blend.sample(FieldStatus::kFar);
}

FieldEvaluator::Found FieldEvaluator::find(const CubeKey& key) {
  const CachedTile& cached = tiles_.get(tile_of(key));
  if (!cached.tile) return {cached.availability != TileAvailability::kUnreadable};
  return {true, cached.tile.get(), cached.tile->find_served(cube_index_in_tile(key))};
}

bool FieldEvaluator::waits_for_training(const TileKey& tile) {
  const CachedTile& cached = tiles_.get(tile);
  if (cached.availability == TileAvailability::kUnreadable) return false;  // add_level() sees to it
  if (cached.tile && cached.tile->num_cubes() > 0) return false;
  return model_.occupancy.is_occupied(tile);
}

/// False when a cube that is needed cannot be read.
bool FieldEvaluator::add_level(const CubeKey& own, const Vector3& p_world, Blend& blend) {
  const double edge = model_.lattice.cube_edge(own.level);
  const double margin =
      std::clamp(model_.geometry.margin * static_cast<double>(level_scale(own.level)),
                 kMinMarginRatio * edge, 0.5 * edge);
  const BlendTerms terms =
      partition_of_unity(own, model_.lattice.cube_origin(own), p_world, edge, margin);
  for (int i = 0; i < terms.count; ++i) {
    const BlendTerm& term = terms.terms[static_cast<std::size_t>(i)];
    if (term.weight == 0.0) continue;
    const Found found = find(term.cube);
    if (!found.readable) return false;
    if (found.cube == nullptr) {
      blend.add_missing(term);
      continue;
    }
    const Vector3 p_local = p_world - model_.lattice.cube_origin(term.cube);
    const KernelView kernel = found.tile->kernel(*found.cube);
    blend.add_cube(term, evaluate_with_gradient(kernel, p_local), found.cube->mae);
  }
  blend.finish_level();
  return true;
}

std::optional<FieldSample> FieldEvaluator::gdf1(const Vector3& p_world, const CubeKey& own) {
  const double edge = model_.lattice.cube_size();
  const double margin = std::max(model_.geometry.margin, kMinMarginRatio * edge);
  WeightedMean mean;
  /// False when the cube cannot be read. GDF1 holds no poor cubes.
  const auto add = [&](const Found& found, const Vector3& p_local, double weight) {
    if (found.cube == nullptr || found.cube->status != CubeStatus::kFitted) return found.readable;
    const KernelView kernel = found.tile->kernel(*found.cube);
    mean.add(weight, evaluate_with_gradient(kernel, p_local), found.cube->mae);
    return true;
  };
  const Vector3 p_own = p_world - model_.lattice.cube_origin(own);
  if (std::min(p_own.minCoeff(), (Vector3::Constant(edge) - p_own).minCoeff()) >= margin) {
    if (!add(find(own), p_own, 1.0)) return std::nullopt;
    if (const auto alone = mean.sample()) return alone;
  }
  for (int i = 0; i < 27; ++i) {
    const CubeKey key{0, own.x + i % 3 - 1, own.y + i / 3 % 3 - 1, own.z + i / 9 - 1};
    const Vector3 p_local = p_world - model_.lattice.cube_origin(key);
    const double weight = gdf1_blend_weight(p_local, edge, margin);
    if (weight <= kMinGdf1Weight) continue;
    if (!add(find(key), p_local, weight)) return std::nullopt;
  }
  return mean.sample();
}

}  // namespace gdfmap
