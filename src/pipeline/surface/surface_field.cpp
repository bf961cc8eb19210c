#include "surface_field.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <gdfmap/core/error.hpp>

namespace gdfmap::surface {
namespace {

constexpr double kMinResolution = 1e-4;

BlendZones zones_of(const Geometry& geometry) {
  return {0, geometry.cube_size, partition_margin(geometry.margin, geometry.cube_size)};
}

const SurfaceRange& checked(const SurfaceRange& range, const Geometry& geometry) {
  check_length("resolution", range.resolution, kMinResolution, geometry.cube_size);
  if (!(range.max_mae >= 0.0)) {
    throw Error(ErrorCode::kUsage, "max_mae must be a number of metres from 0");
  }
  if (range.region && (range.region->isEmpty() || !range.region->min().allFinite() ||
                       !range.region->max().allFinite())) {
    throw Error(ErrorCode::kUsage, "the region is no box");
  }
  return range;
}

}  // namespace

void check_length(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw Error(ErrorCode::kUsage, std::string(name) + " must be from " + std::to_string(low) +
                                     " m to the edge of a cube, " + std::to_string(high) +
                                     " m, not " + std::to_string(value));
}

SurfaceField::SurfaceField(const std::shared_ptr<TileSource>& source, const SurfaceRange& range,
                           double reach, const RunContext& context)
    : domain_(
          *source,
          SampleGrid(checked(range, source->geometry()).resolution, source->geometry().cube_size),
          reach, range.region),
      tiles_(source, context.memory() / 4),
      field_{domain_, tiles_, zones_of(source->geometry()), range.max_mae,
             surface_kernels(best_instruction_set())} {
  if (domain_.tiles().empty()) {
    throw Error(ErrorCode::kUsage, range.region ? "the region holds nothing of the map"
                                                : "the map holds no occupied cube");
  }
}

std::size_t SurfaceField::block_side() const {
  // One more than the quotient, since it may be rounded.
  const double samples = domain_.lattice().cube_size() / domain_.grid().resolution() + 1.0;
  return static_cast<std::size_t>(
      std::min(std::ceil(samples), static_cast<double>(BlockSampler::kMaxSide)));
}

void SurfaceField::report_tiles(SurfaceReport& report) const {
  TileCacheStatistics statistics = tiles_.statistics();
  report.num_unreadable_tiles = statistics.unreadable;
  report.first_error = std::move(statistics.first_error);
}

std::size_t blocks_at_a_time(std::size_t max_bytes_of_block, const RunContext& context) {
  constexpr std::size_t kBlocksOfThread = 32;
  const auto threads = static_cast<std::size_t>(context.threads());
  const std::size_t that_fit = context.memory() / 4 / max_bytes_of_block;
  return std::clamp(that_fit, threads, kBlocksOfThread * threads);
}

}  // namespace gdfmap::surface
