#pragma once

#include <array>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/field/blending.hpp>
#include <gdfmap/query/distance_field.hpp>
#include <gdfmap/query/occupancy_index.hpp>

#include "field_kernels.hpp"

namespace gdfmap {

/// What is the same for all queries of a field. Immutable, shared by its threads.
struct FieldModel {
  Lattice lattice;
  Geometry geometry;
  BlendMode blend;
  Precision precision;
  const FieldKernels<float>* kernels;  ///< of this machine
  OccupancyIndex occupancy;
  bool has_cubes;
  /// Of each level; kGdf1 wants their margin alone.
  std::array<BlendZones, kMaxLevels> zones;
};

}  // namespace gdfmap
