#include "unit_cache.hpp"

#include <algorithm>
#include <exception>
#include <functional>
#include <utility>

#include <gdfmap/core/morton.hpp>

namespace gdfmap {
namespace {

/// Points beyond which a part of a tile is split into octants.
constexpr std::uint64_t kMaxUnitPoints = 250'000;
/// What an index takes of each point, and the point itself while indices are built. The order of
/// the points, 16 bytes each at most, exists for one index at a time and is not counted.
constexpr std::size_t kIndexBytesPerPoint = 14, kBuildBytesPerPoint = 6;
/// The part of the bytes for indices that parts built at once may take.
constexpr std::size_t kShareBuiltAtOnce = 2;

/// Numbers of points in the cells of a grid over an octant, as fine as one pass over the points can
/// count.
class CellCounts {
 public:
  explicit CellCounts(const Octant& octant)
      : octant_(octant),
        cells_(std::min(kMaxCells, octant.size)),
        cell_size_(octant.size / cells_),
        counts_(static_cast<std::size_t>(cells_) * static_cast<std::size_t>(cells_) *
                static_cast<std::size_t>(cells_)) {}

  void add(const TileOffset& p) {
    if (octant_.contains(p)) {
      ++counts_[place((p.x - octant_.x) / cell_size_, (p.y - octant_.y) / cell_size_,
                      (p.z - octant_.z) / cell_size_)];
    }
  }
  /// Whether a part is a cell, which nothing is known of the inside of.
  [[nodiscard]] bool is_cell(const Octant& part) const { return part.size == cell_size_; }
  [[nodiscard]] std::uint64_t count_in(const Octant& part) const {
    const std::int32_t width = part.size / cell_size_;
    const auto first = [&](std::int32_t low, std::int32_t from) {
      return (low - from) / cell_size_;
    };
    const std::int32_t x0 = first(part.x, octant_.x), y0 = first(part.y, octant_.y),
                       z0 = first(part.z, octant_.z);
    std::uint64_t sum = 0;
    for (std::int32_t z = z0; z < z0 + width; ++z) {
      for (std::int32_t y = y0; y < y0 + width; ++y) {
        for (std::int32_t x = x0; x < x0 + width; ++x) sum += counts_[place(x, y, z)];
      }
    }
    return sum;
  }

 private:
  static constexpr std::int32_t kMaxCells = 32;

  [[nodiscard]] std::size_t place(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return static_cast<std::size_t>((z * cells_ + y) * cells_ + x);
  }

  Octant octant_;
  std::int32_t cells_, cell_size_;  ///< cells along an axis, and the steps of each
  std::vector<std::uint64_t> counts_;
};

std::uint64_t code_of(std::int32_t x, std::int32_t y, std::int32_t z) {
  return morton_code(static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y),
                     static_cast<std::uint64_t>(z));
}

/// Sorts points into octants that do not overlap, given in Morton order.
class OctantSorter {
 public:
  explicit OctantSorter(std::vector<Octant> octants) : octants_(std::move(octants)) {
    for (const Octant& octant : octants_) {
      codes_.push_back(code_of(octant.x, octant.y, octant.z));
      around_.extend(octant.box());
    }
  }
  /// The octant of a point; the number of octants when it is in none of them.
  [[nodiscard]] std::size_t octant_of(const TileOffset& p) {
    // Blocks are in Morton order, so that most points lie where the last one did.
    if (last_ < octants_.size() && octants_[last_].contains(p)) return last_;
    const Eigen::Vector3f place(static_cast<float>(p.x), static_cast<float>(p.y),
                                static_cast<float>(p.z));
    if (!around_.contains(place)) return octants_.size();
    const auto next = std::ranges::upper_bound(codes_, code_of(p.x, p.y, p.z));
    const auto found = static_cast<std::size_t>(next - codes_.begin());
    if (found == 0 || !octants_[found - 1].contains(p)) return octants_.size();
    return last_ = found - 1;
  }

 private:
  std::vector<Octant> octants_;
  std::vector<std::uint64_t> codes_;  ///< of their corners
  Eigen::AlignedBox3f around_;        ///< all of them
  std::size_t last_ = 0;
};

}  // namespace

UnitCache::UnitCache(PointStore& store, std::span<const TilePoints> tiles, std::size_t max_bytes)
    : store_(store), tiles_(tiles), max_bytes_(max_bytes) {}

std::span<const UnitCache::Part> UnitCache::parts(std::size_t tile) {
  static const Part kWhole;
  if (tiles_[tile].num_points <= kMaxUnitPoints) return {&kWhole, 1};
  const auto known = [&]() -> std::span<const Part> {
    const std::lock_guard lock(mutex_);
    const auto found = parts_.find(tile);
    return found == parts_.end() ? std::span<const Part>() : found->second;
  };
  if (const auto parts = known(); !parts.empty()) return parts;
  const std::lock_guard store_lock(store_mutex_);
  if (const auto parts = known(); !parts.empty()) return parts;  // another thread was faster
  std::vector<Part> result = split(tiles_[tile]);
  const std::lock_guard lock(mutex_);
  return parts_[tile] = std::move(result);
}

std::vector<UnitCache::Part> UnitCache::split(const TilePoints& tile) {
  std::vector<Part> result;
  const std::function<void(const Octant&)> count_and_split = [&](const Octant& octant) {
    CellCounts counts(octant);
    store_.for_each_block(tile.key, [&](std::span<const TileOffset> points) {
      for (const TileOffset& p : points) counts.add(p);
    });
    const std::function<void(const Octant&)> add = [&](const Octant& part) {
      const std::uint64_t count = counts.count_in(part);
      if (count == 0) return;
      // A part of one step holds one point, however often blocks repeat it.
      if (count <= kMaxUnitPoints || part.size == 1) {
        result.push_back({part, count});
      } else if (counts.is_cell(part)) {
        count_and_split(part);
      } else {
        for (int i = 0; i < 8; ++i) add(part.child(i));
      }
    };
    add(octant);
  };
  count_and_split({});
  return result;
}

UnitCache::Index UnitCache::index(std::size_t tile, std::size_t part) {
  const std::span<const Part> all = parts(tile);
  std::vector<Claim> claims;
  std::shared_future<Index> result;
  {
    const std::lock_guard lock(mutex_);
    const auto found = entries_.find({tile, part});
    if (found != entries_.end()) {
      recent_.splice(recent_.begin(), recent_, found->second);
      result = found->second->index;
    } else {
      claims = claim(tile, part, all);
      result = entries_.at({tile, part})->index;
    }
  }
  try {
    if (!claims.empty()) build(tile, all, claims);
  } catch (...) {
    for (Claim& claim : claims) {
      if (claim.is_kept) continue;
      claim.index.set_exception(std::current_exception());
      forget({tile, claim.part});
    }
    throw;
  }
  return result.get();
}

/// The part, and those behind it that nobody builds or has, as far as there is room for them. With
/// mutex_ held.
std::vector<UnitCache::Claim> UnitCache::claim(std::size_t tile, std::size_t part,
                                               std::span<const Part> parts) {
  const std::uint64_t max_points =
      max_bytes_ / kShareBuiltAtOnce / (kIndexBytesPerPoint + kBuildBytesPerPoint);
  std::vector<Claim> claims;
  std::uint64_t num_points = 0;
  for (; part < parts.size() && !entries_.contains({tile, part}); ++part) {
    num_points += parts[part].num_points;
    if (!claims.empty() && num_points > max_points) break;
    claims.push_back({part, {}});
    recent_.push_front({{tile, part}, claims.back().index.get_future().share()});
    entries_[{tile, part}] = recent_.begin();
  }
  return claims;
}

void UnitCache::build(std::size_t tile, std::span<const Part> parts, std::span<Claim> claims) {
  std::vector<std::vector<NearestPointIndex::Point>> points(claims.size());
  std::vector<Octant> octants;
  for (std::size_t i = 0; i < claims.size(); ++i) {
    octants.push_back(parts[claims[i].part].octant);
    points[i].reserve(parts.size() > 1 ? parts[claims[i].part].num_points
                                       : tiles_[tile].num_points);
  }
  OctantSorter sorter(std::move(octants));
  {
    const std::lock_guard lock(store_mutex_);
    store_.for_each_block(tiles_[tile].key, [&](std::span<const TileOffset> block) {
      for (const TileOffset& p : block) {
        const std::size_t i = sorter.octant_of(p);
        if (i < points.size()) points[i].push_back({p.x, p.y, p.z});
      }
    });
  }
  for (std::size_t i = 0; i < claims.size(); ++i) {
    auto index = std::make_shared<const NearestPointIndex>(points[i]);
    points[i] = {};
    const std::size_t bytes = index->memory_bytes();
    claims[i].index.set_value(std::move(index));
    claims[i].is_kept = true;
    account({tile, claims[i].part}, bytes);
  }
}

void UnitCache::account(const Key& key, std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  entries_.at(key)->bytes = bytes;
  bytes_ += bytes;
  for (auto oldest = recent_.end(); bytes_ > max_bytes_ && oldest != recent_.begin();) {
    --oldest;
    if (oldest->bytes == 0 || oldest->key == key) continue;
    bytes_ -= oldest->bytes;
    entries_.erase(oldest->key);
    oldest = recent_.erase(oldest);
  }
}

void UnitCache::forget(const Key& key) {
  const std::lock_guard lock(mutex_);
  recent_.erase(entries_.at(key));
  entries_.erase(key);
}

bool UnitCache::has_room_for(std::uint64_t num_points) const {
  return num_points * kIndexBytesPerPoint <= max_bytes_;
}

bool UnitCache::is_full() const {
  const std::lock_guard lock(mutex_);
  return bytes_ >= max_bytes_;
}

}  // namespace gdfmap
