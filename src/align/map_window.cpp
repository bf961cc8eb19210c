#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

#include <gdfmap/align/map_window.hpp>
#include <gdfmap/core/morton.hpp>

namespace gdfmap {
namespace {

/// Calls its argument with the points of every tile, in any number of pieces.
using TilePointVisitor = std::function<void(const TileKey&, std::span<const TileOffset>)>;
using TilePointSource = std::function<void(const TilePointVisitor&)>;

/// What a voxel's moments, its mean and normal and its place in the tree take, about.
constexpr std::size_t kBytesPerVoxel = 320;
/// Voxels of a surface in a cube that it crosses, at a quarter of the cube's edge, about.
constexpr std::size_t kVoxelsPerCube = 32;

struct WindowTile {
  TileKey key;
  std::uint64_t num_points = 0;
};

/// A place near the points that does not depend on their order: the mean of the tiles' centres.
LatticePoint choose_origin(std::span<const WindowTile> tiles, const Lattice& lattice) {
  Vector3 sum = Vector3::Zero();
  double num_points = 0.0;
  for (const WindowTile& tile : tiles) {
    const double count = static_cast<double>(tile.num_points);
    sum += count * lattice.tile_box(tile.key).center();
    num_points += count;
  }
  if (num_points == 0.0) return {};
  return lattice.quantize(sum / num_points).value_or(LatticePoint{});
}

/// The mean of the points of every voxel relative to the origin, in Morton order of the voxels.
std::vector<Vector3> means_of(const VoxelGrid& grid, const LatticePoint& origin) {
  std::vector<const std::pair<const VoxelKey, VoxelMoments>*> voxels;
  voxels.reserve(grid.voxels().size());
  for (const auto& voxel : grid.voxels()) voxels.push_back(&voxel);
  std::sort(voxels.begin(), voxels.end(),
            [](const auto* a, const auto* b) { return in_morton_order(a->first, b->first); });
  const std::int64_t edge = grid.voxel_steps();
  std::vector<Vector3> means;
  means.reserve(voxels.size());
  for (const auto* voxel : voxels) {
    const VoxelKey& key = voxel->first;
    const Vector3 corner(static_cast<double>(key.x * edge - origin.x),
                         static_cast<double>(key.y * edge - origin.y),
                         static_cast<double>(key.z * edge - origin.z));
    means.push_back(grid.step() * (corner + voxel->second.mean()));
  }
  return means;
}

using TileOffsets = std::map<TileKey, std::vector<TileOffset>>;

TileOffsets split_into_tiles(std::span<const Vector3> points_world, const Lattice& lattice) {
  TileOffsets tiles;
  for (const Vector3& p_world : points_world) {
    const std::optional<LatticePoint> p = lattice.quantize(p_world);
    if (!p) continue;
    const TileKey tile = tile_of(*p);
    const LatticePoint corner = tile_origin(tile);
    const auto offset = [](std::int64_t steps) { return static_cast<std::uint16_t>(steps); };
    tiles[tile].push_back(
        {offset(p->x - corner.x), offset(p->y - corner.y), offset(p->z - corner.z)});
  }
  for (auto& [tile, offsets] : tiles) sort_unique(offsets);
  return tiles;
}

/// The level-0 tiles within reach of points.
std::set<TileKey> tiles_around(std::span<const Vector3> points_world, double reach,
                               const Lattice& lattice) {
  std::set<TileKey> own;
  for (const Vector3& p_world : points_world) {
    const auto cube = lattice.cube_containing(p_world, 0);
    if (cube) own.insert(tile_of(*cube));
  }
  const double edge = lattice.cube_size() * kCubesPerTileAxis;
  const auto rings = static_cast<std::int32_t>(std::ceil(reach / edge));
  std::set<TileKey> all;
  for (const TileKey& tile : own) {
    for (std::int32_t x = -rings; x <= rings; ++x) {
      for (std::int32_t y = -rings; y <= rings; ++y) {
        for (std::int32_t z = -rings; z <= rings; ++z) {
          all.insert({0, tile.x + x, tile.y + y, tile.z + z});
        }
      }
    }
  }
  return all;
}

Vector3 center_of(std::span<const Vector3> points) {
  Vector3 sum = Vector3::Zero();
  double count = 0.0;
  for (const Vector3& p : points) {
    if (!p.allFinite()) continue;
    sum += p;
    count += 1.0;
  }
  return count > 0.0 ? Vector3(sum / count) : Vector3::Zero();
}

struct TileSelection {
  std::vector<WindowTile> tiles;  ///< in key order
  std::size_t num_left_out = 0;
};

/// Those tiles that hold points, nearest to the scan's centre first, as many as the bytes allow.
TileSelection select_tiles(Map& map, std::span<const Vector3> scan_world,
                           const MapWindow::MapOptions& options) {
  struct Candidate {
    double distance;
    WindowTile tile;
    std::size_t num_bytes;
  };
  const Vector3 center_world = center_of(scan_world);
  std::vector<Candidate> candidates;
  for (const TileKey& key : tiles_around(scan_world, options.reach, map.lattice())) {
    const std::optional<TilePoints> points = map.points().find_tile(key);
    if (!points || points->num_points == 0) continue;
    const std::size_t num_voxels = std::min<std::size_t>(
        points->num_points, kVoxelsPerCube * static_cast<std::size_t>(points->cubes.count()));
    const double distance = map.lattice().tile_box(key).exteriorDistance(center_world);
    candidates.push_back({distance, {key, points->num_points}, kBytesPerVoxel * num_voxels});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.distance < b.distance; });
  TileSelection selection;
  std::size_t num_bytes = 0;
  for (const Candidate& candidate : candidates) {
    num_bytes += candidate.num_bytes;
    if (num_bytes > options.max_bytes) break;
    selection.tiles.push_back(candidate.tile);
  }
  selection.num_left_out = candidates.size() - selection.tiles.size();
  std::sort(selection.tiles.begin(), selection.tiles.end(),
            [](const WindowTile& a, const WindowTile& b) { return a.key < b.key; });
  return selection;
}

}  // namespace

struct MapWindow::Impl {
  Impl(const Lattice& lattice_of_points, std::vector<WindowTile> tiles_of_window)
      : lattice(lattice_of_points),
        tiles(std::move(tiles_of_window)),
        origin(choose_origin(tiles, lattice)),
        origin_world(lattice.to_world(origin)) {}

  [[nodiscard]] VoxelGrid grid(double edge) const {
    VoxelGrid result(lattice, edge);
    visit(
        [&](const TileKey& tile, std::span<const TileOffset> points) { result.add(tile, points); });
    return result;
  }

  Lattice lattice;
  std::vector<WindowTile> tiles;
  std::size_t num_left_out = 0;
  LatticePoint origin;
  Vector3 origin_world;
  TilePointSource visit;
  std::shared_ptr<const DistanceField> field;
  mutable std::mutex mutex;  ///< of what follows, and of the points
  mutable std::map<double, SurfaceCloud> surfaces;
  mutable std::map<double, NdtCells> cells;
};

MapWindow::MapWindow(std::span<const Vector3> points_world) {
  const Lattice lattice(1.0);
  auto offsets = std::make_shared<const TileOffsets>(split_into_tiles(points_world, lattice));
  std::vector<WindowTile> tiles;
  for (const auto& [tile, points] : *offsets) tiles.push_back({tile, points.size()});
  impl_ = std::make_unique<Impl>(lattice, std::move(tiles));
  impl_->visit = [offsets](const TilePointVisitor& visitor) {
    for (const auto& [tile, points] : *offsets) visitor(tile, points);
  };
}

MapWindow::MapWindow(Map& map, std::span<const Vector3> scan_world, const MapOptions& options) {
  TileSelection selection = select_tiles(map, scan_world, options);
  impl_ = std::make_unique<Impl>(map.lattice(), selection.tiles);
  impl_->num_left_out = selection.num_left_out;
  impl_->field = options.field;
  impl_->visit = [&map, tiles = std::move(selection.tiles)](const TilePointVisitor& visitor) {
    for (const WindowTile& tile : tiles) {
      map.points().for_each_block(
          tile.key, [&](std::span<const TileOffset> points) { visitor(tile.key, points); });
    }
  };
}

MapWindow::MapWindow(MapWindow&&) noexcept = default;
MapWindow::~MapWindow() = default;

const Vector3& MapWindow::origin_world() const { return impl_->origin_world; }

std::uint64_t MapWindow::num_points() const {
  std::uint64_t sum = 0;
  for (const WindowTile& tile : impl_->tiles) sum += tile.num_points;
  return sum;
}

std::size_t MapWindow::num_tiles() const { return impl_->tiles.size(); }
std::size_t MapWindow::num_tiles_left_out() const { return impl_->num_left_out; }

const SurfaceCloud& MapWindow::surface(double voxel, int num_threads) const {
  const std::lock_guard lock(impl_->mutex);
  const auto found = impl_->surfaces.find(voxel);
  if (found != impl_->surfaces.end()) return found->second;
  const std::vector<Vector3> means = means_of(impl_->grid(voxel), impl_->origin);
  return impl_->surfaces.try_emplace(voxel, means, 0.0, num_threads).first->second;
}

const NdtCells& MapWindow::cells(double edge) const {
  const std::lock_guard lock(impl_->mutex);
  const auto found = impl_->cells.find(edge);
  if (found != impl_->cells.end()) return found->second;
  return impl_->cells.try_emplace(edge, impl_->grid(edge), impl_->origin).first->second;
}

const DistanceField* MapWindow::field() const { return impl_->field.get(); }

}  // namespace gdfmap
