#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/parallel.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/query/distance_field.hpp>

#include "field_evaluator.hpp"
#include "locality_order.hpp"
#include "tile_loader.hpp"

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

BlendZones zones_of(const Geometry& geometry, BlendMode blend, int level) {
  const auto scale = static_cast<double>(level_scale(level));
  const double edge = scale * geometry.cube_size, margin = scale * geometry.margin;
  return {level, edge,
          blend == BlendMode::kPartition ? partition_margin(margin, edge)
                                         : std::max(margin, kMinMarginRatio * edge)};
}

FieldModel make_model(TileSource& source, const DistanceFieldOptions& options) {
  const Geometry& geometry = checked(source.geometry());
  const auto zones = [&](int level) { return zones_of(geometry, options.blend, level); };
  static_assert(kMaxLevels == 3);
  return {Lattice(geometry.cube_size),
          geometry,
          options.blend,
          options.precision,
          &field_kernels(options.instruction_set),
          OccupancyIndex(source.occupied(), geometry.cube_size),
          source.has_cubes(),
          {zones(0), zones(1), zones(2)}};
}

/// Writes answers where they belong, see FieldEvaluator. Scattered over memory, they would wait for
/// it one after the other.
template <typename Answer, typename Convert>
struct Written {
  Answer* answers;
  const Convert& convert;

  void expect(std::uint32_t i) const {
    const auto* const place = reinterpret_cast<const char*>(answers + i);
    __builtin_prefetch(place, 1);
    __builtin_prefetch(place + sizeof(Answer) - 1, 1);
  }
  void take(std::uint32_t i, const FieldSample& sample) const { answers[i] = convert(sample); }
};

constexpr auto kUnchanged = [](const FieldSample& sample) { return sample; };

}  // namespace

struct DistanceField::Impl {
  using Wanted = FieldEvaluator::Wanted;

  Impl(std::shared_ptr<TileSource> tile_source, const DistanceFieldOptions& how)
      : source(std::move(tile_source)),
        options(how),
        model_now(std::make_shared<const FieldModel>(make_model(*source, options))),
        cache(source, options.cache_bytes),
        num_threads(RunContext{.num_threads = options.num_threads}.threads()) {}

  /// What a query uses from its beginning to its end, whatever refresh() does meanwhile.
  [[nodiscard]] std::shared_ptr<const FieldModel> model() const {
    const std::lock_guard lock(model_mutex);
    return model_now;
  }

  /// Made when it is wanted first.
  [[nodiscard]] TileLoader& loader() {
    std::call_once(loader_made, [this] { made_loader.emplace(cache); });
    return *made_loader;
  }

  /// convert(answer) for every point, in parallel.
  /// @param tile_loader  see FieldEvaluator
  template <typename Answer, typename Convert>
  void answer(std::span<const Vector3> points_world, std::span<Answer> answers, Wanted wanted,
              TileLoader* tile_loader, const Convert& convert) {
    if (points_world.size() != answers.size()) {
      throw Error(ErrorCode::kUsage, std::to_string(points_world.size()) + " points but room for " +
                                         std::to_string(answers.size()) + " answers");
    }
    const std::shared_ptr<const FieldModel> snapshot = model();
    for (std::size_t first = 0; first < points_world.size(); first += kMaxOrdered) {
      const auto part =
          points_world.subspan(first, std::min(kMaxOrdered, points_world.size() - first));
      const std::vector<OrderedPoint> order = locality_order(part, snapshot->zones[0]);
      const Written<Answer, Convert> written{answers.data() + first, convert};
      const auto answer_chunk = [&](std::size_t chunk) {
        const std::size_t begin = chunk * kChunk;
        FieldEvaluator(*snapshot, cache, tile_loader)
            .at(part, std::span(order).subspan(begin, std::min(kChunk, order.size() - begin)),
                wanted, written);
      };
      const std::size_t num_chunks = (order.size() + kChunk - 1) / kChunk;
      const auto threads = std::min(num_chunks, static_cast<std::size_t>(num_threads));
      parallel_for(num_chunks, static_cast<int>(threads), answer_chunk);
    }
  }

  const std::shared_ptr<TileSource> source;
  const DistanceFieldOptions options;
  mutable std::mutex model_mutex;
  std::shared_ptr<const FieldModel> model_now;  ///< guarded by model_mutex
  TileCache cache;
  const int num_threads;
  std::once_flag loader_made;
  std::optional<TileLoader> made_loader;  ///< behind the cache: it ends first
};

DistanceField::DistanceField(std::shared_ptr<TileSource> source,
                             const DistanceFieldOptions& options)
    : impl_(std::make_unique<Impl>(std::move(source), options)) {}
DistanceField::DistanceField(const Map& map, const DistanceFieldOptions& options)
    : DistanceField(std::make_shared<StoreTileSource>(map.cubes_path(), map.geometry()), options) {}
DistanceField::~DistanceField() = default;
DistanceField::DistanceField(DistanceField&&) noexcept = default;
DistanceField& DistanceField::operator=(DistanceField&&) noexcept = default;

const Geometry& DistanceField::geometry() const { return impl_->source->geometry(); }

FieldSample DistanceField::at(const Vector3& p_world) const {
  const std::shared_ptr<const FieldModel> model = impl_->model();
  return FieldEvaluator(*model, impl_->cache).at(p_world);
}

void DistanceField::at(std::span<const Vector3> points_world,
                       std::span<FieldSample> samples) const {
  impl_->answer(points_world, samples, Impl::Wanted::kValueAndGradient, nullptr, kUnchanged);
}

void DistanceField::distances(std::span<const Vector3> points_world,
                              std::span<double> distances) const {
  impl_->answer(points_world, distances, Impl::Wanted::kValue, nullptr,
                [](const FieldSample& sample) { return sample.distance; });
}

void DistanceField::conservative_distances(std::span<const Vector3> points_world,
                                           std::span<double> distances) const {
  impl_->answer(points_world, distances, Impl::Wanted::kValue, nullptr,
                [](const FieldSample& sample) { return sample.conservative_distance(); });
}

void DistanceField::try_at(std::span<const Vector3> points_world,
                           std::span<FieldSample> samples) const {
  impl_->answer(points_world, samples, Impl::Wanted::kValueAndGradient, &impl_->loader(),
                kUnchanged);
}

void DistanceField::prefetch(std::span<const Vector3> points_world) const {
  const std::shared_ptr<const FieldModel> model = impl_->model();
  FieldPlanner planner(*model, impl_->cache, &impl_->loader());
  for (const Vector3& p_world : points_world) {
    planner.request_tiles(p_world);
    planner.release();
  }
}

std::size_t DistanceField::refresh() {
  auto model = std::make_shared<const FieldModel>(make_model(*impl_->source, impl_->options));
  const std::size_t num_dropped = impl_->cache.refresh();
  const std::lock_guard lock(impl_->model_mutex);
  impl_->model_now = std::move(model);
  return num_dropped;
}

TileCacheStatistics DistanceField::statistics() const { return impl_->cache.statistics(); }

}  // namespace gdfmap
