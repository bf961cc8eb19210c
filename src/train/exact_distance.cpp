#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <list>
#include <unordered_map>
#include <utility>

#include <gdfmap/core/parallel.hpp>
#include <gdfmap/edt/nearest_point_index.hpp>
#include <gdfmap/train/exact_distance.hpp>

namespace gdfmap {
namespace {

/// Points beyond which a unit is split into octants.
constexpr std::uint64_t kMaxUnitPoints = 1'000'000;
/// Samples that one task of a parallel loop looks up.
constexpr std::size_t kSamplesPerTask = 256;
constexpr double kSlack = 1e-6;
/// Rings of tiles looked up by key; farther ones are found by a scan over all tiles.
constexpr std::int64_t kMaxRing = 4;

/// A cubic part of a tile, in steps from the tile's corner.
struct Octant {
  std::int32_t x = 0, y = 0, z = 0;
  std::int32_t size = kStepsPerTileAxis;

  [[nodiscard]] bool contains(const TileOffset& p) const {
    return p.x - x >= 0 && p.x - x < size && p.y - y >= 0 && p.y - y < size && p.z - z >= 0 &&
           p.z - z < size;
  }
  [[nodiscard]] Octant child(int index) const {
    const std::int32_t half = size / 2;
    return {x + (index & 1) * half, y + (index >> 1 & 1) * half, z + (index >> 2 & 1) * half, half};
  }
  [[nodiscard]] Eigen::AlignedBox3f box() const {
    const Eigen::Vector3f low(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    return {low, low + Eigen::Vector3f::Constant(static_cast<float>(size - 1))};
  }
};

/// A unit's place: index of its tile among all tiles, and of its octant among the tile's.
struct UnitKey {
  std::size_t tile = 0, octant = 0;
  bool operator==(const UnitKey&) const = default;
};

struct UnitKeyHash {
  std::size_t operator()(const UnitKey& key) const noexcept { return key.tile * 4099 + key.octant; }
};

/// The samples of one call and the best found so far.
class Search {
 public:
  Search(const LatticePoint& origin, std::span<const Eigen::Vector3i> samples, int num_threads)
      : origin_(origin),
        samples_(samples),
        best_squared_(samples.size(), std::numeric_limits<float>::infinity()),
        num_threads_(num_threads) {
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
    const std::size_t num_tasks = (samples_.size() + kSamplesPerTask - 1) / kSamplesPerTask;
    parallel_for(num_tasks, num_threads_, [&](std::size_t task) {
      const std::size_t begin = task * kSamplesPerTask;
      const std::size_t count = std::min(kSamplesPerTask, samples_.size() - begin);
      std::array<Eigen::Vector3f, kSamplesPerTask> relative;
      for (std::size_t i = 0; i < count; ++i) {
        relative[i] = (samples_[begin + i].cast<double>() - offset).cast<float>();
      }
      index.update({relative.data(), count}, std::span(best_squared_).subspan(begin, count));
    });
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
  std::vector<float> best_squared_;
  double worst_ = std::numeric_limits<double>::infinity();  // only a visit changes it
  Eigen::AlignedBox3i bounds_;
  int num_threads_;
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
  PointStore& store;
  std::span<const TilePoints> tiles;
  std::size_t index_bytes;

  std::unordered_map<TileKey, std::size_t, TileKeyHash> tile_of_key;
  std::unordered_map<std::size_t, std::vector<Octant>> octants_of_tile;  // over-full tiles only

  using Unit = std::pair<UnitKey, std::shared_ptr<const NearestPointIndex>>;
  std::list<Unit> recent;  // most recently used first
  std::unordered_map<UnitKey, std::list<Unit>::iterator, UnitKeyHash> loaded;
  std::size_t loaded_bytes = 0;

  Impl(PointStore& s, std::span<const TilePoints> t, std::size_t bytes)
      : store(s), tiles(t), index_bytes(bytes) {
    tile_of_key.reserve(tiles.size());
    for (std::size_t i = 0; i < tiles.size(); ++i) tile_of_key.emplace(tiles[i].key, i);
  }

  [[nodiscard]] std::vector<Octant> octants(std::size_t tile);
  void split(const TileKey& key, const Octant& octant, std::vector<Octant>& result);
  [[nodiscard]] std::shared_ptr<const NearestPointIndex> unit(const UnitKey& key,
                                                              const Octant& octant);
  [[nodiscard]] NearestPointIndex load(const TileKey& key, const Octant& octant);

  void visit_tile(Search& search, std::size_t tile);
  void visit_nearest_first(Search& search, std::span<const std::size_t> candidates);
  [[nodiscard]] std::vector<std::size_t> tiles_in_ring(const Search& search,
                                                       std::int64_t ring) const;
  [[nodiscard]] std::vector<std::size_t> tiles_beyond(const Search& search,
                                                      std::int64_t ring) const;
};

std::vector<Octant> ExactDistance::Impl::octants(std::size_t tile) {
  if (tiles[tile].num_points <= kMaxUnitPoints) return {Octant{}};
  const auto known = octants_of_tile.find(tile);
  if (known != octants_of_tile.end()) return known->second;
  std::vector<Octant>& result = octants_of_tile[tile];
  split(tiles[tile].key, Octant{}, result);
  return result;
}

void ExactDistance::Impl::split(const TileKey& key, const Octant& octant,
                                std::vector<Octant>& result) {
  std::array<std::uint64_t, 8> counts{};
  const int half = octant.size / 2;
  store.for_each_block(key, [&](std::span<const TileOffset> points) {
    for (const TileOffset& p : points) {
      if (!octant.contains(p)) continue;
      ++counts[static_cast<std::size_t>((p.x - octant.x >= half ? 1 : 0) +
                                        (p.y - octant.y >= half ? 2 : 0) +
                                        (p.z - octant.z >= half ? 4 : 0))];
    }
  });
  for (int i = 0; i < 8; ++i) {
    const std::uint64_t count = counts[static_cast<std::size_t>(i)];
    if (count == 0) continue;
    // An octant of one step holds one point, however often blocks repeat it.
    if (count > kMaxUnitPoints && half > 1) {
      split(key, octant.child(i), result);
    } else {
      result.push_back(octant.child(i));
    }
  }
}

NearestPointIndex ExactDistance::Impl::load(const TileKey& key, const Octant& octant) {
  std::vector<Eigen::Vector3f> points;
  store.for_each_block(key, [&](std::span<const TileOffset> block) {
    for (const TileOffset& p : block) {
      if (octant.contains(p)) points.emplace_back(p.x, p.y, p.z);
    }
  });
  return NearestPointIndex(std::move(points));
}

std::shared_ptr<const NearestPointIndex> ExactDistance::Impl::unit(const UnitKey& key,
                                                                   const Octant& octant) {
  const auto found = loaded.find(key);
  if (found != loaded.end()) {
    recent.splice(recent.begin(), recent, found->second);
    return recent.front().second;
  }
  auto index = std::make_shared<const NearestPointIndex>(load(tiles[key.tile].key, octant));
  loaded_bytes += index->memory_bytes();
  recent.emplace_front(key, index);
  loaded[key] = recent.begin();
  while (loaded_bytes > index_bytes && recent.size() > 1) {
    loaded_bytes -= recent.back().second->memory_bytes();
    loaded.erase(recent.back().first);
    recent.pop_back();
  }
  return index;
}

ExactDistance::ExactDistance(PointStore& store, std::span<const TilePoints> tiles,
                             std::size_t index_bytes)
    : impl_(std::make_unique<Impl>(store, tiles, index_bytes)) {}
ExactDistance::~ExactDistance() = default;

void ExactDistance::Impl::visit_tile(Search& search, std::size_t tile) {
  const TileKey& key = tiles[tile].key;
  const std::vector<Octant> parts = octants(tile);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!(search.distance_to(key, parts[i].box()) < search.worst())) continue;
    const auto index = unit({tile, i}, parts[i]);
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

std::vector<std::size_t> ExactDistance::Impl::tiles_in_ring(const Search& search,
                                                            std::int64_t ring) const {
  const TileKey low = search.lowest_tile(), high = search.highest_tile();
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

std::vector<std::size_t> ExactDistance::Impl::tiles_beyond(const Search& search,
                                                           std::int64_t ring) const {
  const TileKey low = search.lowest_tile(), high = search.highest_tile();
  std::vector<std::size_t> found;
  for (std::size_t tile = 0; tile < tiles.size(); ++tile) {
    if (ring_of(tiles[tile].key, low, high) > ring) found.push_back(tile);
  }
  return found;
}

std::vector<double> ExactDistance::nearest(const LatticePoint& origin,
                                           std::span<const Eigen::Vector3i> samples,
                                           int num_threads) {
  if (samples.empty()) return {};
  Search search(origin, samples, num_threads);
  for (std::int64_t ring = 0; ring <= kMaxRing; ++ring) {
    // Tiles of a ring are at least ring − 1 whole tiles away.
    if (static_cast<double>(ring - 1) * kStepsPerTileAxis >= search.worst()) break;
    impl_->visit_nearest_first(search, impl_->tiles_in_ring(search, ring));
  }
  if (search.worst() > static_cast<double>(kMaxRing) * kStepsPerTileAxis) {
    impl_->visit_nearest_first(search, impl_->tiles_beyond(search, kMaxRing));
  }
  return search.distances();
}

}  // namespace gdfmap
