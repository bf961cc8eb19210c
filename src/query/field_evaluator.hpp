#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "field_planner.hpp"
#include "locality_order.hpp"

namespace gdfmap {

/// Points of one plan.
template <typename Number>
struct FieldPacket {
  FieldPlan plan;
  KernelPacket<Number> points;
  std::array<Vector3, kPacketSize> p_world;
  std::array<std::uint32_t, kPacketSize> indices;  ///< of the points among those asked for

  [[nodiscard]] bool is_full() const { return points.num_points == kPacketSize; }
  void add(const Vector3& p, std::uint32_t index);
  /// Whether a point lies in a cube that holds points. False also where the plan is whole.
  [[nodiscard]] bool is_in_occupied_cube(std::size_t i) const;
};

/// Answers queries of one thread, one by one or many together, with the same bits.
class FieldEvaluator {
 public:
  /// All outlive it. @param loader  fetches tiles that are not in memory, which are answered with
  ///                                kPending meanwhile; null: they are waited for
  FieldEvaluator(const FieldModel& model, TileCache& cache, TileLoader* loader = nullptr)
      : model_(model), planner_(model, cache, loader) {}

  [[nodiscard]] FieldSample at(const Vector3& p_world);

  /// Answers the points that `order` names, in that order. With kValue the answers have no
  /// gradients.
  /// @param answers  take(index, answer) for each, and expect(index) a while before, so that the
  ///                 place it goes to can be fetched meanwhile
  enum class Wanted { kValue, kValueAndGradient };
  template <typename Answers>
  void at(std::span<const Vector3> points_world, std::span<const OrderedPoint> order, Wanted wanted,
          const Answers& answers);

 private:
  /// Packets that are planned before they are evaluated: enough that their cubes arrive from memory
  /// meanwhile.
  static constexpr std::size_t kGroupSize = 16;
  static constexpr std::size_t kLookAhead = 16;
  using Samples = std::array<FieldSample, kPacketSize>;

  template <typename Number>
  [[nodiscard]] FieldSample one(const Vector3& p_world);
  template <typename Number, typename Answers>
  void many(std::span<const Vector3> points_world, std::span<const OrderedPoint> order,
            Wanted wanted, const Answers& answers);
  /// Makes `next` a packet without points for the plan of this one, which is that of `same`, if
  /// any.
  template <typename Number>
  void start(FieldPacket<Number>& next, const FieldPacket<Number>* same, const Vector3& p_world);
  template <typename Number>
  void evaluate(const FieldPacket<Number>& packet, Wanted wanted, Samples& samples) const;
  [[nodiscard]] FieldSample gdf1(const Vector3& p_world);

  const FieldModel& model_;
  FieldPlanner planner_;
};

template <typename Answers>
void FieldEvaluator::at(std::span<const Vector3> points_world, std::span<const OrderedPoint> order,
                        Wanted wanted, const Answers& answers) {
  if (model_.blend == BlendMode::kGdf1) {
    for (const OrderedPoint& point : order) {
      answers.take(point.index, gdf1(points_world[point.index]));
    }
  } else if (model_.precision == Precision::kDouble) {
    many<double>(points_world, order, wanted, answers);
  } else {
    many<float>(points_world, order, wanted, answers);
  }
}

template <typename Number, typename Answers>
void FieldEvaluator::many(std::span<const Vector3> points_world,
                          std::span<const OrderedPoint> order, Wanted wanted,
                          const Answers& answers) {
  std::array<FieldPacket<Number>, kGroupSize> packets;
  std::size_t count = 0;
  const auto finish = [&] {
    Samples samples;
    for (const FieldPacket<Number>& packet : std::span(packets).first(count)) {
      evaluate(packet, wanted, samples);
      for (std::size_t i = 0; i < packet.points.num_points; ++i) {
        answers.take(packet.indices[i], samples[i]);
      }
    }
    planner_.release();
    count = 0;
  };
  for (std::size_t i = 0; i < order.size(); ++i) {
    // Points and answers lie anywhere: one at a time is fetched, since of many at once the
    // processor would drop most.
    if (i + kLookAhead < order.size()) {
      __builtin_prefetch(&points_world[order[i + kLookAhead].index]);
    }
    const std::uint32_t index = order[i].index;
    answers.expect(index);
    const Vector3& p_world = points_world[index];
    const FieldPacket<Number>* const last = count > 0 ? &packets[count - 1] : nullptr;
    const bool goes_on = last != nullptr && planner_.holds(last->plan, p_world, order[i].zone);
    if (!goes_on || last->is_full()) {
      if (count == kGroupSize || planner_.holds_many_tiles()) finish();
      start(packets[count], goes_on && count > 0 ? last : nullptr, p_world);
      ++count;
    }
    packets[count - 1].add(p_world, index);
  }
  finish();
}

}  // namespace gdfmap
