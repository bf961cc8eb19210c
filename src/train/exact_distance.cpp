#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
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
      : origin_(origin), packets_(make_packets(samples)), order_(order) {
    for (const SamplePacket& packet : packets_) {
      const auto axes =
          Eigen::Map<const Eigen::Array<float, SamplePacket::kSize, 3>>(packet.xyz[0]);
      bounds_.extend(axes.colwise().minCoeff().matrix().transpose().cast<int>().eval());
      bounds_.extend(axes.colwise().maxCoeff().matrix().transpose().cast<int>().eval());
    }
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
    index.update(packets_, offset_of(tile).cast<float>(), order_);
    float worst_squared = 0.0f;
    for (const SamplePacket& packet : packets_) {
      worst_squared = std::max(worst_squared, squares(packet).maxCoeff());
    }
    worst_ = std::sqrt(static_cast<double>(worst_squared));
  }

  [[nodiscard]] std::vector<double> distances() const {
    std::vector<double> result(packets_.size() * SamplePacket::kSize);
    std::size_t count = 0;
    for (const SamplePacket& packet : packets_) {
      Eigen::Map<Squares<double>>(result.data() + count) = squares(packet).cast<double>().sqrt();
      count += packet.count;
    }
    result.resize(count);
    return result;
  }

 private:
  template <typename Scalar>
  using Squares = Eigen::Array<Scalar, SamplePacket::kSize, 1>;
  [[nodiscard]] static Eigen::Map<const Squares<float>> squares(const SamplePacket& packet) {
    return Eigen::Map<const Squares<float>>(packet.best_squared);
  }
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
  std::vector<SamplePacket> packets_;
  SampleOrder order_;
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

  /// A part of a tile.
  struct Unit {
    std::size_t tile = 0, part = 0;
    auto operator<=>(const Unit&) const = default;
  };

  [[nodiscard]] std::optional<Unit> nearest_unit(const Search& search);
  void visit_unit(const Unit& unit, std::span<Search* const> searches, int num_threads);
  [[nodiscard]] std::vector<std::size_t> tiles_within(std::span<const Search> searches) const;
  [[nodiscard]] std::vector<std::size_t> tiles_around(std::span<const TileKey> keys) const;
  void visit_tile(Search& search, std::size_t tile);
  void visit_nearest_first(Search& search, std::span<const std::size_t> candidates);
  /// visit(tiles) for rings of tiles around the samples, as far as they may hold something nearer.
  template <typename Visit>
  void visit_rings(const Search& search, const Visit& visit) const {
    const TileKey low = search.lowest_tile(), high = search.highest_tile();
    for (std::int64_t ring = 0; ring <= kMaxRing; ++ring) {
      // Tiles of a ring are at least ring − 1 whole tiles away.
      if (static_cast<double>(ring - 1) * kStepsPerTileAxis >= search.worst()) break;
      visit(tiles_in_ring(low, high, ring));
    }
    if (search.worst() > static_cast<double>(kMaxRing) * kStepsPerTileAxis) {
      visit(tiles_beyond(low, high, kMaxRing));
    }
  }
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
  const std::span<const UnitCache::Part> parts = units.parts(tile);
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    order.emplace_back(search.distance_to(key, parts[i].octant.box()), i);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [distance, part] : order) {
    if (!(distance < search.worst())) return;
    const auto index = units.index(tile, part);
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
  impl_->visit_rings(search, [&](std::span<const std::size_t> candidates) {
    impl_->visit_nearest_first(search, candidates);
  });
  return search.distances();
}

/// The one whose box is nearest in the tile whose box is nearest.
std::optional<ExactDistance::Impl::Unit> ExactDistance::Impl::nearest_unit(const Search& search) {
  const TileKey low = search.lowest_tile(), high = search.highest_tile();
  std::vector<std::size_t> candidates;
  for (std::int64_t ring = 0; ring <= kMaxRing && candidates.empty(); ++ring) {
    candidates = tiles_in_ring(low, high, ring);
  }
  if (candidates.empty()) candidates = tiles_beyond(low, high, kMaxRing);
  if (candidates.empty()) return std::nullopt;
  const std::size_t tile = *std::ranges::min_element(candidates, {}, [&](std::size_t candidate) {
    return search.distance_to(tiles[candidate].key, Octant{}.box());
  });
  const auto parts = units.parts(tile);
  const auto part = std::ranges::min_element(parts, {}, [&](const UnitCache::Part& candidate) {
    return search.distance_to(tiles[tile].key, candidate.octant.box());
  });
  return Unit{tile, static_cast<std::size_t>(part - parts.begin())};
}

/// For those of the searches that it may hold something nearer for.
void ExactDistance::Impl::visit_unit(const Unit& unit, std::span<Search* const> searches,
                                     int num_threads) {
  const TileKey& key = tiles[unit.tile].key;
  const auto may_help = [&](const Search& search, const Eigen::AlignedBox3f& box) {
    return search.distance_to(key, box) < search.worst();
  };
  std::vector<Search*> wanting;
  const Eigen::AlignedBox3f box = units.parts(unit.tile)[unit.part].octant.box();
  std::ranges::copy_if(searches, std::back_inserter(wanting),
                       [&](const Search* search) { return may_help(*search, box); });
  if (wanting.empty()) return;
  const auto index = units.index(unit.tile, unit.part);
  parallel_for(wanting.size(), num_threads, [&](std::size_t i) {
    if (may_help(*wanting[i], index->bounds())) wanting[i]->visit(key, *index);
  });
}

/// Tiles that may hold something nearer for one of the searches, each of which has found something.
std::vector<std::size_t> ExactDistance::Impl::tiles_within(std::span<const Search> searches) const {
  std::set<std::size_t> found;
  for (const Search& search : searches) {
    const auto add = [&](std::span<const std::size_t> candidates) {
      for (const std::size_t tile : candidates) {
        const double distance = search.distance_to(tiles[tile].key, Octant{}.box());
        if (distance < search.worst()) found.insert(tile);
      }
    };
    visit_rings(search, add);
  }
  return {found.begin(), found.end()};
}

std::vector<std::vector<double>> ExactDistance::nearest(std::span<const SampleGroup> groups,
                                                        int num_threads) {
  std::vector<Search> searches;
  searches.reserve(groups.size());
  std::map<Impl::Unit, std::vector<Search*>> first_units;
  std::vector<std::optional<Impl::Unit>> first_unit_of;
  for (const SampleGroup& group : groups) {
    if (group.samples.empty()) continue;
    searches.emplace_back(group.origin, group.samples, group.order);
    first_unit_of.push_back(impl_->nearest_unit(searches.back()));
    if (const auto& unit = first_unit_of.back()) first_units[*unit].push_back(&searches.back());
  }
  // First a distance for every sample, which the other units can be held against.
  for (const auto& [unit, wanting] : first_units) impl_->visit_unit(unit, wanting, num_threads);
  if (!first_units.empty()) {
    std::vector<Search*> others;
    for (const std::size_t tile : impl_->tiles_within(searches)) {
      for (std::size_t part = 0; part < impl_->units.parts(tile).size(); ++part) {
        const Impl::Unit unit{tile, part};
        others.clear();
        for (std::size_t i = 0; i < searches.size(); ++i) {
          if (first_unit_of[i] != unit) others.push_back(&searches[i]);
        }
        impl_->visit_unit(unit, others, num_threads);
      }
    }
  }
  std::vector<std::vector<double>> distances(groups.size());
  auto search = searches.begin();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (!groups[i].samples.empty()) distances[i] = (search++)->distances();
  }
  return distances;
}

/// Those in and next to tiles of any level.
std::vector<std::size_t> ExactDistance::Impl::tiles_around(std::span<const TileKey> keys) const {
  std::vector<std::size_t> around;
  for (const TileKey& key : keys) {
    const auto scale = static_cast<std::int32_t>(level_scale(key.level));
    const TileKey low{0, key.x * scale, key.y * scale, key.z * scale};
    const TileKey high{0, low.x + scale - 1, low.y + scale - 1, low.z + scale - 1};
    for (const std::int64_t ring : {0, 1}) {
      const std::vector<std::size_t> found = tiles_in_ring(low, high, ring);
      around.insert(around.end(), found.begin(), found.end());
    }
  }
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  return around;
}

bool ExactDistance::can_keep(std::span<const TileKey> keys) const {
  std::uint64_t num_points = 0;
  for (const std::size_t tile : impl_->tiles_around(keys)) {
    num_points += impl_->tiles[tile].num_points;
  }
  return impl_->units.has_room_for(num_points);
}

void ExactDistance::prefetch(std::span<const TileKey> keys, int num_threads) {
  const std::vector<std::size_t> wanted = impl_->tiles_around(keys);
  UnitCache& units = impl_->units;
  parallel_for(wanted.size(), num_threads, [&](std::size_t i) {
    const std::size_t num_parts = units.parts(wanted[i]).size();
    for (std::size_t part = 0; part < num_parts && !units.is_full(); ++part) {
      static_cast<void>(units.index(wanted[i], part));
    }
  });
}

}  // namespace gdfmap
