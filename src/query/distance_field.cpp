#include <algorithm>
#include <cmath>
#include <string>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/parallel.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/query/distance_field.hpp>

#include "field_evaluator.hpp"
#include "locality_order.hpp"

namespace gdfmap {
namespace {

/// Points that one thread answers in a row: enough to share tiles, few enough to keep threads busy.
constexpr std::size_t kChunk = 2048;

const Geometry& checked(const Geometry& geometry) {
  if (geometry.num_levels < 1 || geometry.num_levels > kMaxLevels) {
    throw Error(ErrorCode::kUsage, "num_levels must be 1 to " + std::to_string(kMaxLevels) +
                                       ", not " + std::to_string(geometry.num_levels));
  }
  if (!std::isfinite(geometry.margin) || geometry.margin < 0.0) {
    throw Error(ErrorCode::kUsage,
                "margin must be a number of metres from 0, not " + std::to_string(geometry.margin));
  }
  return geometry;
}

FieldModel make_model(TileSource& source, BlendMode blend) {
  const Geometry& geometry = checked(source.geometry());
  return {Lattice(geometry.cube_size), geometry, blend,
          OccupancyIndex(source.occupied(), geometry.cube_size), source.has_cubes()};
}

}  // namespace

struct DistanceField::Impl {
  Impl(std::shared_ptr<TileSource> source, const DistanceFieldOptions& options)
      : model(make_model(*source, options.blend)),
        cache(std::move(source), options.cache_bytes),
        num_threads(RunContext{.num_threads = options.num_threads}.threads()) {}

  FieldModel model;
  TileCache cache;
  int num_threads;
};

DistanceField::DistanceField(std::shared_ptr<TileSource> source,
                             const DistanceFieldOptions& options)
    : impl_(std::make_unique<Impl>(std::move(source), options)) {}
DistanceField::DistanceField(const Map& map, const DistanceFieldOptions& options)
    : DistanceField(std::make_shared<StoreTileSource>(map.cubes_path(), map.geometry()), options) {}
DistanceField::~DistanceField() = default;
DistanceField::DistanceField(DistanceField&&) noexcept = default;
DistanceField& DistanceField::operator=(DistanceField&&) noexcept = default;

const Geometry& DistanceField::geometry() const { return impl_->model.geometry; }

FieldSample DistanceField::at(const Vector3& p_world) const {
  return FieldEvaluator(impl_->model, impl_->cache).at(p_world);
}

void DistanceField::at(std::span<const Vector3> points_world,
                       std::span<FieldSample> samples) const {
  if (points_world.size() != samples.size()) {
    throw Error(ErrorCode::kUsage, std::to_string(points_world.size()) + " points but room for " +
                                       std::to_string(samples.size()) + " samples");
  }
  const std::vector<std::size_t> order = locality_order(points_world, impl_->model.lattice);
  const std::size_t num_chunks = (order.size() + kChunk - 1) / kChunk;
  const auto answer_chunk = [&](std::size_t chunk) {
    FieldEvaluator evaluator(impl_->model, impl_->cache);
    const std::size_t end = std::min(order.size(), (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
      samples[order[i]] = evaluator.at(points_world[order[i]]);
    }
  };
  const auto num_threads = std::min(num_chunks, static_cast<std::size_t>(impl_->num_threads));
  parallel_for(num_chunks, std::max(1, static_cast<int>(num_threads)), answer_chunk);
}

TileCacheStatistics DistanceField::statistics() const { return impl_->cache.statistics(); }

}  // namespace gdfmap
