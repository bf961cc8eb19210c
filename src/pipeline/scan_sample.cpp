#include "scan_sample.hpp"

#include <unordered_set>

#include <gdfmap/align/ndt_cells.hpp>

namespace gdfmap {
namespace {

constexpr std::size_t kPointsPerRead = std::size_t{1} << 14;

/// The first point of every voxel.
class VoxelSampler {
 public:
  VoxelSampler(double voxel, std::size_t max_points) : max_points_(max_points) {
    sample_.voxel = voxel;
  }

  void add(const Vector3& p) {
    if (!insert(p)) return;
    sample_.p_nominal.push_back(p);
    while (sample_.p_nominal.size() > max_points_) coarsen();
  }

  [[nodiscard]] ScanSample take() { return std::move(sample_); }

 private:
  bool insert(const Vector3& p) {
    const Vector3 voxels = p / sample_.voxel;
    return occupied_
        .insert({floor_to_integer(voxels.x()), floor_to_integer(voxels.y()),
                 floor_to_integer(voxels.z())})
        .second;
  }

  void coarsen() {
    sample_.voxel *= 2.0;
    occupied_.clear();
    std::erase_if(sample_.p_nominal, [&](const Vector3& p) { return !insert(p); });
  }

  std::size_t max_points_;
  ScanSample sample_;
  std::unordered_set<VoxelKey, VoxelKeyHash> occupied_;
};

}  // namespace

ScanSample sample_scan(PointReader& reader, const IngestOptions& options, const Lattice& lattice,
                       double voxel, std::size_t max_points, const RunContext& context) {
  VoxelSampler sampler(voxel, max_points);
  std::vector<Vector3> points(kPointsPerRead);
  std::uint64_t num_read = 0;
  while (const std::size_t count = reader.read(points)) {
    context.throw_if_stopped();
    for (const Vector3& p_source : std::span(points).first(count)) {
      if (options.drop_zero && p_source.isZero(0.0)) continue;
      const Vector3 p = options.transform.apply(p_source);
      // Refuses what is not finite or beyond the lattice.
      if (!lattice.quantize(p)) continue;
      if (!options.region || options.region->contains(p)) sampler.add(p);
    }
    num_read += count;
    context.progress({.stage = "points",
                      .done = num_read,
                      .total = reader.info().num_points.value_or(0),
                      .detail = "read for registration",
                      .fraction = reader.fraction_read().value_or(-1.0)});
  }
  return sampler.take();
}

}  // namespace gdfmap
