#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include <gdfmap/core/parallel.hpp>
#include <gdfmap/train/exact_distance.hpp>

#include "unit_cache.hpp"

namespace gdfmap {
namespace {

constexpr double kSlack = 1e-6;
/// Rings of tiles looked up by key; farther ones are found by a scan over all tiles.
constexpr std::int64_t kMaxRing = 4;

/// The samples of one call and the best found so far.
class Search {
 public:
  Search(const LatticePoint& origin, std::span<const Eigen::Vector3i> samples, SampleOrder order)
      : origin_(origin),
        samples_(samples),
        order_(order),
        relative_(samples.size()),
        best_squared_(samples.size(), std::numeric_limits<float>::infinity()) {
    for (const Eigen::Vector3i& s : samples) bounds_.extend(s);
  }

  /// Tiles that hold samples, lowest and highest key.
  [[nodiscard]] TileKey lowest_tile() const { return tile_at(bounds_.min()); }
  [[nodiscard]] TileKey highest_tile() const { return tile_at(bounds_.max()); }

  /// Largest best distance so far, in steps; infinity while a sample has none.
  [[nodiscard]] double worst() const { return worst_; }

  /// A lower bound of the distances from the samples to a box that is given relative to a tile's
  /// corner. The slack covers the rounding of squared distances, so that no order of visits can
  /// change a result.
  [[nodiscard]] double distance_to(const TileKey& tile, const Eigen::AlignedBox3f& box) const {
    const Eigen::Vector3d offset = offset_of(tile);
    const Eigen::Vector3d low = box.min().cast<double>() + offset;
    const Eigen::Vector3d high = box.max().cast<double>() + offset;
    const Eigen::Vector3d outside = (low - bounds_.max().cast<double>())
                                        .cwiseMax(bounds_.min().cast<double>() - high)
                                        .cwiseMax(0.0);
    return outside.norm() * (1.0 - kSlack);
  }

  void visit(const TileKey& tile, const NearestPointIndex& index) {
    const Eigen::Vector3d offset = offset_of(tile);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      relative_[i] = (samples_[i].cast<double>() - offset).cast<float>();
    }
    index.update(relative_, order_, best_squared_);
    worst_ = std::sqrt(
        static_cast<double>(*std::max_element(best_squared_.begin(), best_squared_.end())));
  }

  [[nodiscard]] std::vector<double> distances() const {
    std::vector<double> result(best_squared_.size());
    std::transform(best_squared_.begin(), best_squared_.end(), result.begin(),
                   [](float squared) { return std::sqrt(static_cast<double>(squared)); });
    return result;
  }

 private:
  [[nodiscard]] TileKey tile_at(const Eigen::Vector3i& sample) const {
    return tile_of(
        LatticePoint{origin_.x + sample.x(), origin_.y + sample.y(), origin_.z + sample.z()});
  }
  /// From the samples' origin to a tile's corner, in steps.
  [[nodiscard]] Eigen::Vector3d offset_of(const TileKey& tile) const {
    const LatticePoint corner = tile_origin(tile);
    return {static_cast<double>(corner.x - origin_.x), static_cast<double>(corner.y - origin_.y),
            static_cast<double>(corner.z - origin_.z)};
  }

  LatticePoint origin_;
  std::span<const Eigen::Vector3i> samples_;
  SampleOrder order_;
  std::vector<Eigen::Vector3f> relative_;  // to the corner of the tile that is visited
  std::vector<float> best_squared_;
  double worst_ = std::numeric_limits<double>::infinity();  // only a visit changes it
  Eigen::AlignedBox3i bounds_;
};

/// How many tiles lie between a tile and the range of tiles that holds the samples (0: within).
std::int64_t ring_of(const TileKey& tile, const TileKey& low, const TileKey& high) {
  const auto outside = [](std::int64_t v, std::int64_t a, std::int64_t b) {
    return std::max({a - v, v - b, std::int64_t{0}});
  };
  return std::max({outside(tile.x, low.x, high.x), outside(tile.y, low.y, high.y),
                   outside(tile.z, low.z, high.z)});
}

}  // namespace

struct ExactDistance::Impl {
  std::span<const TilePoints> tiles;
  UnitCache units;
  std::unordered_map<TileKey, std::size_t, TileKeyHash> tile_of_key;

  Impl(PointStore& store, std::span<const TilePoints> t, std::size_t bytes)
      : tiles(t), units(store, t, bytes) {
    tile_of_key.reserve(tiles.size());
    for (std::size_t i = 0; i < tiles.size(); ++i) tile_of_key.emplace(tiles[i].key, i);
  }

  void visit_tile(Search& search, std::size_t tile);
  void visit_nearest_first(Search& search, std::span<const std::size_t> candidates);
  [[nodiscard]] std::vector<std::size_t> tiles_in_ring(const TileKey& low, const TileKey& high,
                                                       std::int64_t ring) const;
  [[nodiscard]] std::vector<std::size_t> tiles_beyond(const TileKey& low, const TileKey& high,
                                                      std::int64_t ring) const;
};

ExactDistance::ExactDistance(PointStore& store, std::span<const TilePoints> tiles,
                             std::size_t index_bytes)
    : impl_(std::make_unique<Impl>(store, tiles, index_bytes)) {}
ExactDistance::~ExactDistance() = default;

void ExactDistance::Impl::visit_tile(Search& search, std::size_t tile) {
  const TileKey& key = tiles[tile].key;
  const std::vector<Octant> parts = units.parts(tile);
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    order.emplace_back(search.distance_to(key, parts[i].box()), i);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [distance, part] : order) {
    if (!(distance < search.worst())) return;
    const auto index = units.index(tile, part, parts[part]);
    if (search.distance_to(key, index->bounds()) < search.worst()) search.visit(key, *index);
  }
}

void ExactDistance::Impl::visit_nearest_first(Search& search,
                                              std::span<const std::size_t> candidates) {
  std::vector<std::pair<double, std::size_t>> order;
  for (const std::size_t tile : candidates) {
    order.emplace_back(search.distance_to(tiles[tile].key, Octant{}.box()), tile);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [distance, tile] : order) {
    if (!(distance < search.worst())) return;
    visit_tile(search, tile);
  }
}

std::vector<std::size_t> ExactDistance::Impl::tiles_in_ring(const TileKey& low, const TileKey& high,
                                                            std::int64_t ring) const {
  std::vector<std::size_t> found;
  for (std::int64_t x = low.x - ring; x <= high.x + ring; ++x) {
    for (std::int64_t y = low.y - ring; y <= high.y + ring; ++y) {
      for (std::int64_t z = low.z - ring; z <= high.z + ring; ++z) {
        const TileKey key{0, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                          static_cast<std::int32_t>(z)};
        if (ring_of(key, low, high) != ring) continue;
        const auto tile = tile_of_key.find(key);
        if (tile != tile_of_key.end()) found.push_back(tile->second);
      }
    }
  }
  return found;
}

std::vector<std::size_t> ExactDistance::Impl::tiles_beyond(const TileKey& low, const TileKey& high,
                                                           std::int64_t ring) const {
  std::vector<std::size_t> found;
  for (std::size_t tile = 0; tile < tiles.size(); ++tile) {
    if (ring_of(tiles[tile].key, low, high) > ring) found.push_back(tile);
  }
  return found;
}

std::vector<double> ExactDistance::nearest(const LatticePoint& origin,
                                           std::span<const Eigen::Vector3i> samples,
                                           SampleOrder order) {
  if (samples.empty()) return {};
  Search search(origin, samples, order);
  const TileKey low = search.lowest_tile(), high = search.highest_tile();
  for (std::int64_t ring = 0; ring <= kMaxRing; ++ring) {
    // Tiles of a ring are at least ring − 1 whole tiles away.
    if (static_cast<double>(ring - 1) * kStepsPerTileAxis >= search.worst()) break;
    impl_->visit_nearest_first(search, impl_->tiles_in_ring(low, high, ring));
  }
  if (search.worst() > static_cast<double>(kMaxRing) * kStepsPerTileAxis) {
    impl_->visit_nearest_first(search, impl_->tiles_beyond(low, high, kMaxRing));
  }
  return search.distances();
}

void ExactDistance::prefetch(std::span<const TileKey> keys, int num_threads) {
  std::vector<std::size_t> wanted;
  for (const TileKey& key : keys) {
    for (const std::int64_t ring : {0, 1}) {
      const std::vector<std::size_t> tiles = impl_->tiles_in_ring(key, key, ring);
      wanted.insert(wanted.end(), tiles.begin(), tiles.end());
    }
  }
  std::sort(wanted.begin(), wanted.end());
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  UnitCache& units = impl_->units;
  parallel_for(wanted.size(), num_threads, [&](std::size_t i) {
    const std::vector<Octant> parts = units.parts(wanted[i]);
    for (std::size_t part = 0; part < parts.size() && !units.is_full(); ++part) {
      static_cast<void>(units.index(wanted[i], part, parts[part]));
    }
  });
}

}  // namespace gdfmap
