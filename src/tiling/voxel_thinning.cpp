#include "voxel_thinning.hpp"

#include <bit>
#include <cstdint>

namespace gdfmap {
namespace {

/// Where a coordinate lies: its voxel, counted through the tile, and twice its distance from the
/// voxel's centre.
struct AxisPlace {
  std::uint64_t voxel;
  std::int64_t twice_off_centre;
};

/// The voxels of a cube along an axis, all of one size.
class VoxelAxis {
 public:
  explicit VoxelAxis(int steps)
      : steps_(static_cast<std::uint32_t>(steps)),
        per_cube_((kStepsPerCube + steps_ - 1) / steps_) {}

  [[nodiscard]] AxisPlace place(std::uint16_t offset) const {
    const std::uint32_t in_cube = offset % kStepsPerCube;
    const std::uint32_t voxel = in_cube / steps_;
    const std::int64_t twice_centre = (2 * std::int64_t{voxel} + 1) * steps_;
    return {offset / kStepsPerCube * per_cube_ + voxel, 2 * std::int64_t{in_cube} - twice_centre};
  }

 private:
  static constexpr std::uint32_t kStepsPerCube = kStepsPerCubeAxis;
  std::uint32_t steps_;
  std::uint32_t per_cube_;
};

/// The best point of each voxel, by open addressing with linear probing.
class BestOfVoxel {
 public:
  explicit BestOfVoxel(std::size_t max_voxels) : entries_(std::bit_ceil(2 * max_voxels)) {}

  /// Points must come in the order that decides between equally near ones.
  void offer(std::uint64_t voxel, std::uint64_t distance, std::uint32_t point,
             std::vector<bool>& kept) {
    Entry& entry = find(voxel);
    if (entry.voxel == kFree) {
      entry = {voxel, distance, point};
    } else if (distance < entry.distance) {
      kept[entry.point] = false;
      entry.distance = distance;
      entry.point = point;
    } else {
      kept[point] = false;
    }
  }

 private:
  static constexpr std::uint64_t kFree = ~std::uint64_t{0};
  struct Entry {
    std::uint64_t voxel = kFree;
    std::uint64_t distance = 0;
    std::uint32_t point = 0;
  };

  Entry& find(std::uint64_t voxel) {
    const std::uint64_t mixed = voxel * 0x9e3779b97f4a7c15u;
    std::size_t place = static_cast<std::size_t>(mixed ^ mixed >> 32) & (entries_.size() - 1);
    while (entries_[place].voxel != kFree && entries_[place].voxel != voxel) {
      place = (place + 1) & (entries_.size() - 1);
    }
    return entries_[place];
  }

  std::vector<Entry> entries_;
};

}  // namespace

void thin(std::vector<TileOffset>& points, int voxel_steps) {
  if (voxel_steps == 0 || points.size() < 2) return;
  const VoxelAxis axis(voxel_steps);
  BestOfVoxel best(points.size());
  std::vector<bool> kept(points.size(), true);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const AxisPlace x = axis.place(points[i].x);
    const AxisPlace y = axis.place(points[i].y);
    const AxisPlace z = axis.place(points[i].z);
    const auto distance = static_cast<std::uint64_t>(x.twice_off_centre * x.twice_off_centre +
                                                     y.twice_off_centre * y.twice_off_centre +
                                                     z.twice_off_centre * z.twice_off_centre);
    best.offer(x.voxel | y.voxel << 16 | z.voxel << 32, distance, static_cast<std::uint32_t>(i),
               kept);
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (kept[i]) points[count++] = points[i];
  }
  points.resize(count);
}

}  // namespace gdfmap
