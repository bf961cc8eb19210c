#include "point_changes.hpp"

#include <map>

namespace gdfmap {
namespace {

/// What one source has in a tile of any level.
struct SourcePart {
  Digest digest;
  std::vector<Box3> boxes;
};

Box3 whole_tile(const TileKey& tile) {
  const auto edge = static_cast<double>(kCubesPerTileAxis * level_scale(tile.level));
  const Vector3 low = edge * Vector3(tile.x, tile.y, tile.z);
  return {low, low + Vector3::Constant(edge)};
}

}  // namespace

std::vector<Box3> PointChanges::since(std::span<const SurroundingTile> former,
                                      std::span<const SurroundingTile> today) {
  std::vector<Box3> boxes;
  const auto add = [&](const TileKey& tile, const Digest& before) {
    const std::vector<Box3>& change = change_of(tile, before);
    boxes.insert(boxes.end(), change.begin(), change.end());
  };
  auto f = former.begin();
  auto t = today.begin();
  while (f != former.end() || t != today.end()) {
    if (t == today.end() || (f != former.end() && f->key < t->key)) {
      add(f->key, f->digest);
      ++f;
    } else if (f == former.end() || t->key < f->key) {
      add(t->key, {});
      ++t;
    } else {
      if (f->digest != t->digest) add(t->key, f->digest);
      ++f;
      ++t;
    }
  }
  return boxes;
}

const std::vector<Box3>& PointChanges::change_of(const TileKey& tile, const Digest& former) {
  const auto known = known_.find(tile);
  if (known != known_.end() && known->second.former == former) return known->second.boxes;
  return known_.insert_or_assign(tile, Change{former, find_change(tile, former)})
      .first->second.boxes;
}

/// Digests are sums over sources, and a source that comes later has a higher number: if the latest
/// ones alone make up the difference, they alone were added. What they thin out lies in their
/// cubes, because no voxel reaches across a face.
std::vector<Box3> PointChanges::find_change(const TileKey& tile, const Digest& former) {
  std::map<std::int64_t, SourcePart, std::greater<>> latest_first;
  for (const TileKey& occupied : groups_.occupied_in(tile)) {
    for (const SourceShare& share : store_.shares(occupied)) {
      SourcePart& part = latest_first[share.source];
      part.digest += share.digest;
      part.boxes.push_back(box_of_cubes(occupied, share.cubes));
    }
  }
  const Digest today = groups_.digest(tile);
  Digest sum = former;
  std::vector<Box3> boxes;
  for (const auto& [source, part] : latest_first) {
    sum += part.digest;
    boxes.insert(boxes.end(), part.boxes.begin(), part.boxes.end());
    if (sum == today) return boxes;
  }
  return {whole_tile(tile)};
}

}  // namespace gdfmap
