#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include <gdfmap/core/parallel.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/pipeline/surface.hpp>

#include "block_queue.hpp"
#include "block_sampler.hpp"

namespace gdfmap::surface {

/// The field of a source as surfaces are taken from it, with its tiles in a cache.
class SurfaceField {
 public:
  /// @param reach  see SurfaceDomain
  /// @throws Error kUsage for a range that cannot be used or holds nothing of the map
  SurfaceField(const std::shared_ptr<TileSource>& source, const SurfaceRange& range, double reach,
               const RunContext& context);

  [[nodiscard]] const FieldOnGrid& field() const { return field_; }
  [[nodiscard]] const SurfaceDomain& domain() const { return domain_; }
  /// Samples of the largest block along an axis.
  [[nodiscard]] std::size_t block_side() const;
  /// Puts what became of the tiles into a report.
  void report_tiles(SurfaceReport& report) const;

 private:
  SurfaceDomain domain_;
  TileCache tiles_;
  FieldOnGrid field_;
};

/// @throws Error kUsage naming the option unless low < value ≤ high, in metres
void check_length(const char* name, double value, double low, double high);

/// Blocks whose results are in memory at the same time: enough for all threads, few enough for a
/// quarter of the memory.
[[nodiscard]] std::size_t blocks_at_a_time(std::size_t max_bytes_of_block,
                                           const RunContext& context);

/// take(work(block)) for every block of the queue: the work in parallel, the taking in order.
/// @throws Error kInterrupted when stopped
template <typename Work, typename Take>
void for_each_block(BlockQueue& queue, std::size_t num_tiles, std::size_t at_a_time,
                    const Work& work, const Take& take, const RunContext& context) {
  using Result = decltype(work(Block{}));
  std::vector<Result> results;
  for (auto blocks = queue.take(at_a_time); !blocks.empty(); blocks = queue.take(at_a_time)) {
    context.throw_if_stopped();
    results.clear();
    results.resize(blocks.size());
    parallel_for(blocks.size(), context.threads(),
                 [&](std::size_t i) { results[i] = work(blocks[i]); });
    for (Result& result : results) take(result);
    context.progress({"tiles", queue.num_tiles_done(), num_tiles, {}});
  }
}

}  // namespace gdfmap::surface
