#pragma once

#include <cstddef>
#include <vector>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/tiling/ingest.hpp>

namespace gdfmap {

/// Some points of a cloud, spread evenly over its surfaces.
struct ScanSample {
  std::vector<Vector3> p_nominal;  ///< in the map's frame, moved by the options' transform alone
  double voxel = 0.0;              ///< edge of the voxels that keep their first point, metres
};

/// Reads a cloud to its end and keeps the first point of every voxel; whenever there are more than
/// max_points, the voxels' edges are doubled. Points that ingest would reject do not count; a
/// region is applied to where the first guess puts them.
/// @throws Error kInterrupted when stopped; as the reader does
[[nodiscard]] ScanSample sample_scan(PointReader& reader, const IngestOptions& options,
                                     const Lattice& lattice, double voxel, std::size_t max_points,
                                     const RunContext& context);

}  // namespace gdfmap
