#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "field_planner.hpp"

namespace gdfmap {

/// Answers queries of one thread, one by one or many together, with the same bits.
class FieldEvaluator {
 public:
  /// All outlive it. @param loader  fetches tiles that are not in memory, which are answered with
  ///                                kPending meanwhile; null: they are waited for
  FieldEvaluator(const FieldModel& model, TileCache& cache, TileLoader* loader = nullptr);

  [[nodiscard]] FieldSample at(const Vector3& p_world);

  /// Answers the points that `order` names, in that order. With kValue the answers have no
  /// gradients.
  /// @param answers  take(index, answer) for each, and expect(index) a while before, so that the
  ///                 place it goes to can be fetched meanwhile
  enum class Wanted { kValue, kValueAndGradient };
  template <typename Answers>
  void at(std::span<const Vector3> points_world, std::span<const std::uint32_t> order,
          Wanted wanted, const Answers& answers);

 private:
  /// Points that go to the kernels together: enough that their cubes arrive from memory meanwhile.
  static constexpr std::size_t kGroupSize = 32;
  static constexpr std::size_t kLookAhead = 16;
  /// At most so many cubes share a point.
  static constexpr std::size_t kMaxTerms = std::size_t{8} * kMaxLevels;
  struct Group {
    FieldSample answers[kGroupSize];
    std::uint32_t ends[kGroupSize];
    float values[kGroupSize];
    float value_gradients[kGroupSize][4];
  };

  [[nodiscard]] bool uses_kernels() const {
    return model_.blend == BlendMode::kPartition && model_.precision == Precision::kFloat;
  }
  /// Leaves the cubes' terms behind those in terms_, and returns the rest of the answer.
  [[nodiscard]] FieldSample plan(const Vector3& p_world);
  /// Plans the first points of `order` and returns their number.
  template <typename Answers>
  [[nodiscard]] std::size_t plan_group(std::span<const Vector3> points_world,
                                       std::span<const std::uint32_t> order, const Answers& answers,
                                       Group& group);
  void evaluate(Group& group, std::size_t count, Wanted wanted) const;

  [[nodiscard]] FieldSample exact(const Vector3& p_world);
  [[nodiscard]] FieldSample gdf1(const Vector3& p_world);

  const FieldModel& model_;
  FieldPlanner planner_;
  std::vector<KernelTerm> terms_;
};

template <typename Answers>
void FieldEvaluator::at(std::span<const Vector3> points_world, std::span<const std::uint32_t> order,
                        Wanted wanted, const Answers& answers) {
  if (!uses_kernels()) {
    for (const std::uint32_t i : order) answers.take(i, at(points_world[i]));
    return;
  }
  Group group;
  terms_.reserve(kGroupSize * kMaxTerms);
  while (!order.empty()) {
    const std::size_t count = plan_group(points_world, order, answers, group);
    evaluate(group, count, wanted);
    for (std::size_t i = 0; i < count; ++i) answers.take(order[i], group.answers[i]);
    order = order.subspan(count);
  }
}

template <typename Answers>
std::size_t FieldEvaluator::plan_group(std::span<const Vector3> points_world,
                                       std::span<const std::uint32_t> order, const Answers& answers,
                                       Group& group) {
  planner_.release();
  terms_.clear();
  const std::size_t size = std::min(kGroupSize, order.size());
  std::size_t count = 0;
  do {
    // Points and answers lie anywhere: one at a time is fetched, since of many at once the
    // processor would drop most.
    if (count + kLookAhead < order.size()) {
      __builtin_prefetch(&points_world[order[count + kLookAhead]]);
    }
    answers.expect(order[count]);
    group.answers[count] = plan(points_world[order[count]]);
    group.ends[count++] = static_cast<std::uint32_t>(terms_.size());
  } while (count < size && !planner_.holds_many_tiles());
  return count;
}

}  // namespace gdfmap
