#include "field_evaluator.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <type_traits>

namespace gdfmap {
namespace {

/// Shares below this are none: the ancestor's constant.
constexpr double kMinGdf1Weight = 1e-6;

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

FieldSample no_answer(FieldStatus status) {
  constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
  return {kNotKnown, Vector3::Constant(kNotKnown), status, kNotKnown, kNotKnown};
}

template <typename Number>
const FieldKernels<Number>& kernels_of(const FieldModel& model) {
  if constexpr (std::is_same_v<Number, double>) {
    return exact_field_kernels();
  } else {
    return *model.kernels;
  }
}

template <typename Number>
Vector3 column(const Number (&rows)[3][kPacketSize], std::size_t i) {
  return {static_cast<double>(rows[0][i]), static_cast<double>(rows[1][i]),
          static_cast<double>(rows[2][i])};
}

/// Point i's answer from its sums, without the far bound.
template <typename Number>
FieldSample sample_of(const KernelSums<Number>& sums, std::size_t i, FieldStatus status,
                      FieldEvaluator::Wanted wanted) {
  const auto weight = static_cast<double>(sums.weight[i]);
  return {static_cast<double>(sums.distance[i]),
          wanted == FieldEvaluator::Wanted::kValue ? Vector3(Vector3::Zero())
                                                   : column(sums.gradient, i),
          status,
          weight > 0.0 ? static_cast<double>(sums.mae[i]) / weight
                       : std::numeric_limits<double>::quiet_NaN(),
          static_cast<double>(sums.max_error[i])};
}

}  // namespace

template <typename Number>
void FieldPacket<Number>::add(const Vector3& p, std::uint32_t index) {
  const std::size_t place = points.num_points++;
  p_world[place] = p;
  indices[place] = index;
  for (std::size_t level = 0; level < plan.num_levels; ++level) {
    for (std::size_t a = 0; a < 3; ++a) {
      const auto p_local =
          static_cast<Number>(p[static_cast<Eigen::Index>(a)] - plan.corners[level][a]);
      if (place == 0) {
        std::ranges::fill(points.p_local[level][a], p_local);
      } else {
        points.p_local[level][a][place] = p_local;
      }
    }
  }
}

template <typename Number>
bool FieldPacket<Number>::is_in_occupied_cube(std::size_t i) const {
  if (plan.occupied == 0) return false;
  const KernelLevel& level = plan.levels[0];
  std::size_t cube = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const bool is_second = static_cast<double>(points.p_local[0][a][i]) >= level.edge;
    cube = cube * level.counts[a] + (level.counts[a] == 2 && is_second ? 1 : 0);
  }
  return (plan.occupied >> cube & 1) != 0;
}

template <typename Number>
void FieldEvaluator::start(FieldPacket<Number>& next, const FieldPacket<Number>* same,
                           const Vector3& p_world) {
  if (same != nullptr) {
    next.plan = same->plan;
  } else {
    planner_.make_plan(p_world, next.plan);
  }
  next.points.levels = next.plan.levels.data();
  next.points.num_levels = next.plan.num_levels;
  next.points.is_fine = next.plan.is_whole && next.plan.num_levels == 1;
  next.points.num_points = 0;
}

template <typename Number>
void FieldEvaluator::evaluate(const FieldPacket<Number>& packet, Wanted wanted,
                              Samples& samples) const {
  const std::size_t num_points = packet.points.num_points;
  if (packet.plan.no_answer) {
    std::fill_n(samples.begin(), num_points, no_answer(*packet.plan.no_answer));
    return;
  }
  const FieldKernels<Number>& kernels = kernels_of<Number>(model_);
  KernelSums<Number> sums;
  if (wanted == Wanted::kValue) {
    kernels.distances(packet.points, sums);
  } else {
    kernels.distances_and_gradients(packet.points, sums);
  }
  const FieldStatus status = packet.points.is_fine ? FieldStatus::kFine : FieldStatus::kCoarse;
  for (std::size_t i = 0; i < num_points; ++i) {
    samples[i] = sample_of(sums, i, status, wanted);
    if (packet.plan.is_whole) continue;
    if (packet.is_in_occupied_cube(i)) {
      samples[i].status = FieldStatus::kFar;
      continue;
    }
    const std::optional<FarBound> far = model_.occupancy.nearest(packet.p_world[i]);
    if (!far) {
      samples[i] = no_answer(FieldStatus::kUnknown);
      continue;
    }
    const auto share = static_cast<double>(sums.share[i]);
    samples[i].status = FieldStatus::kFar;
    samples[i].distance += share * far->distance;
    samples[i].gradient += share * far->gradient + far->distance * column(sums.share_gradient, i);
  }
}

template <typename Number>
FieldSample FieldEvaluator::one(const Vector3& p_world) {
  FieldPacket<Number> packet;
  start<Number>(packet, nullptr, p_world);
  packet.add(p_world, 0);
  Samples samples;
  evaluate(packet, Wanted::kValueAndGradient, samples);
  return samples[0];
}

FieldSample FieldEvaluator::at(const Vector3& p_world) {
  if (model_.blend == BlendMode::kGdf1) return gdf1(p_world);
  return model_.precision == Precision::kDouble ? one<double>(p_world) : one<float>(p_world);
}

template struct FieldPacket<float>;
template struct FieldPacket<double>;
template void FieldEvaluator::start(FieldPacket<float>&, const FieldPacket<float>*, const Vector3&);
template void FieldEvaluator::start(FieldPacket<double>&, const FieldPacket<double>*,
                                    const Vector3&);
template void FieldEvaluator::evaluate(const FieldPacket<float>&, Wanted, Samples&) const;
template void FieldEvaluator::evaluate(const FieldPacket<double>&, Wanted, Samples&) const;

FieldSample FieldEvaluator::gdf1(const Vector3& p_world) {
  const std::optional<CubeKey> own = model_.lattice.cube_containing(p_world, 0);
  const FieldSample unknown = no_answer(FieldStatus::kUnknown);
  if (!own || !model_.has_cubes) return unknown;
  const double edge = model_.lattice.cube_size(), margin = model_.zones[0].margin();
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
