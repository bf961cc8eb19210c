#include "field_evaluator.hpp"

#include <algorithm>
#include <optional>

namespace gdfmap {
namespace {

/// Shares below this are none: the ancestor's constant.
constexpr double kMinGdf1Weight = 1e-6;
constexpr std::size_t kFloatsPerCacheLine = 16;
/// Of a cube, from its first row on: all of 8 Gaussians; the processor sees where more are going.
constexpr std::size_t kPrefetchedFloats = kNumGaussianRows * DecodedTile::kAlignedFloats;

/// Σ w·(d_c, ∇d_c, errors) / Σ w.
class WeightedMean {
 public:
  void add(double weight, const ValueGradient& cube, const DecodedTile::Cube& errors) {
    weight_ += weight;
    sum_.value += weight * cube.value;
    sum_.gradient += weight * cube.gradient;
    mae_ += weight * static_cast<double>(errors.mae);
    max_error_ += weight * static_cast<double>(errors.max_error);
  }
  [[nodiscard]] std::optional<FieldSample> answer() const {
    if (weight_ < kMinGdf1Weight) return std::nullopt;
    return FieldSample{sum_.value / weight_, sum_.gradient / weight_, FieldStatus::kFine,
                       mae_ / weight_, max_error_ / weight_};
  }

 private:
  double weight_ = 0.0;
  ValueGradient sum_;
  double mae_ = 0.0, max_error_ = 0.0;
};

void add_value_and_gradient(const float (&sum)[4], FieldSample& sample) {
  sample.distance += static_cast<double>(sum[0]);
  for (int a = 0; a < 3; ++a) sample.gradient[a] += static_cast<double>(sum[a + 1]);
}

}  // namespace

FieldEvaluator::FieldEvaluator(const FieldModel& model, TileCache& cache, TileLoader* loader)
    : model_(model), planner_(model, cache, loader) {
  if (uses_kernels()) terms_.reserve(kMaxTerms);
}

FieldSample FieldEvaluator::at(const Vector3& p_world) {
  if (model_.blend == BlendMode::kGdf1) return gdf1(p_world);
  if (model_.precision == Precision::kDouble) return exact(p_world);
  terms_.clear();
  FieldSample answer = plan(p_world);
  const auto end = static_cast<std::uint32_t>(terms_.size());
  float sum[1][4];
  model_.kernels->values_and_gradients(terms_.data(), &end, 1, sum);
  add_value_and_gradient(sum[0], answer);
  return answer;
}

void FieldEvaluator::evaluate(Group& group, std::size_t count, Wanted wanted) const {
  if (wanted == Wanted::kValue) {
    model_.kernels->values(terms_.data(), group.ends, count, group.values);
    for (std::size_t i = 0; i < count; ++i) {
      group.answers[i].distance += static_cast<double>(group.values[i]);
    }
  } else {
    model_.kernels->values_and_gradients(terms_.data(), group.ends, count, group.value_gradients);
    for (std::size_t i = 0; i < count; ++i) {
      add_value_and_gradient(group.value_gradients[i], group.answers[i]);
    }
  }
}

FieldSample FieldEvaluator::plan(const Vector3& p_world) {
  const std::size_t num_terms = terms_.size();
  const auto add = [this](const KernelView& cube, const Vector3& p_local, double weight,
                          const Vector3& weight_gradient) {
    const auto narrow = [](double v) { return static_cast<float>(v); };
    terms_.push_back(
        {cube.data,
         static_cast<std::uint32_t>(cube.stride),
         {narrow(p_local.x()), narrow(p_local.y()), narrow(p_local.z())},
         narrow(weight),
         {narrow(weight_gradient.x()), narrow(weight_gradient.y()), narrow(weight_gradient.z())}});
    for (std::size_t i = 0; i < kPrefetchedFloats; i += kFloatsPerCacheLine) {
      __builtin_prefetch(cube.data + i);
    }
  };
  const FieldSample rest = planner_.plan(p_world, add);
  if (rest.status >= FieldStatus::kUnknown) terms_.resize(num_terms);
  return rest;
}

FieldSample FieldEvaluator::exact(const Vector3& p_world) {
  ValueGradient sum;
  const auto add = [&sum](const KernelView& cube, const Vector3& p_local, double weight,
                          const Vector3& weight_gradient) {
    const ValueGradient term = evaluate_with_gradient(cube, p_local);
    sum.value += weight * term.value;
    sum.gradient += weight * term.gradient + term.value * weight_gradient;
  };
  FieldSample answer = planner_.plan(p_world, add);
  answer.distance += sum.value;
  answer.gradient += sum.gradient;
  return answer;
}

FieldSample FieldEvaluator::gdf1(const Vector3& p_world) {
  const std::optional<CubeKey> own = model_.lattice.cube_containing(p_world, 0);
  const FieldSample unknown = no_answer(FieldStatus::kUnknown);
  if (!own || !model_.has_cubes) return unknown;
  const double edge = model_.lattice.cube_size(), margin = model_.margins[0];
  WeightedMean mean;
  /// False when the cube cannot be read, or not yet. GDF1 holds no poor cubes.
  FieldSample no_mean = unknown;
  const auto add = [&](const FieldPlanner::Found& found, const Vector3& p_local, double weight) {
    if (found.availability == TileAvailability::kPending)
      no_mean = no_answer(FieldStatus::kPending);
    if (found.cube == nullptr || found.cube->status != CubeStatus::kFitted) {
      return found.availability == TileAvailability::kAbsent ||
             found.availability == TileAvailability::kLoaded;
    }
    const KernelView kernel = found.tile->kernel(*found.cube);
    mean.add(weight, evaluate_with_gradient(kernel, p_local), *found.cube);
    return true;
  };
  const Vector3 p_own = p_world - model_.lattice.cube_origin(*own);
  if (std::min(p_own.minCoeff(), (Vector3::Constant(edge) - p_own).minCoeff()) >= margin) {
    if (!add(planner_.find(*own), p_own, 1.0)) return no_mean;
    if (const auto alone = mean.answer()) return *alone;
  }
  for (int i = 0; i < 27; ++i) {
    const CubeKey key{0, own->x + i % 3 - 1, own->y + i / 3 % 3 - 1, own->z + i / 9 - 1};
    const Vector3 p_local = p_world - model_.lattice.cube_origin(key);
    const double weight = gdf1_blend_weight(p_local, edge, margin);
    if (weight <= kMinGdf1Weight) continue;
    if (!add(planner_.find(key), p_local, weight)) return no_mean;
  }
  return mean.answer().value_or(unknown);
}

}  // namespace gdfmap
