#pragma once

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/tiling/ingest.hpp>

namespace gdfmap {

/// @throws Error kUsage for options that cannot be used with this lattice.
void check_options(const IngestOptions& options, const Lattice& lattice);

/// Edge of a thinning voxel in quantisation steps; 0: none.
[[nodiscard]] int voxel_steps(const IngestOptions& options, const Lattice& lattice);

}  // namespace gdfmap
