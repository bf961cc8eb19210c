#pragma once

#include <cstddef>

#include <gdfmap/core/instruction_set.hpp>

namespace gdfmap::surface {

/// The Gaussians of one cube, as rows of `stride` floats that start on 64 bytes, filled up to
/// `stride`, a multiple of kLaneFloats, with Gaussians that are zero everywhere.
struct GaussianRows {
  const float* mean[3];     ///< metres from the cube's minimum corner
  const float* inverse[3];  ///< 1 / variance
  const float* weight;      ///< metres
  std::size_t count;
  std::size_t stride;
};

/// One cube's part in the values of a block of a regular lattice. There a Gaussian is the product
/// of three vectors, one an axis, and so is the cube's share: with the share of each axis as factor
/// of its vector, the part is Σ_k z[k] · y[k] · x[k].
struct BlockTerm {
  std::size_t num_gaussians;
  const float* x;  ///< [Gaussian][sample], rows `x_stride` apart
  std::size_t x_stride;
  const float *y, *z;          ///< [sample][Gaussian], rows `stride` apart
  std::size_t stride;          ///< as in GaussianRows
  std::size_t x_begin, x_end;  ///< multiples of kLaneFloats
  std::size_t y_begin, y_end, z_begin, z_end;
  float* products;  ///< room for `stride` floats
  float* values;    ///< to be added to, [z][y][x], on 64 bytes
  std::size_t row, plane;
};

/// Values and gradients at points, given and returned coordinate by coordinate.
struct PointTerm {
  std::size_t num_points;  ///< a multiple of kLaneFloats
  const float* p_local[3];
  float* value;
  float* gradient[3];
};

/// Kernels of one instruction set. A sample's or a point's result depends on the Gaussians and its
/// own position alone and has the same bits for every set, whatever stands beside it. To be called
/// with FlushToZero.
struct SurfaceKernels {
  /// out[i] = exp(−½ (position[i] − mean)² · inverse) · share[i] for `count` samples, a multiple of
  /// kLaneFloats.
  void (*factors_of_gaussian)(const float* position, const float* share, std::size_t count,
                              float mean, float inverse, float* out);
  /// The same for one sample and all Gaussians of a row: out[k], times factor[k] unless null.
  void (*factors_of_sample)(float position, float share, const float* mean, const float* inverse,
                            const float* factor, std::size_t count, float* out);
  void (*add_block)(const BlockTerm& term);
  void (*values_and_gradients)(const GaussianRows& cube, const PointTerm& points);
};

/// The set must be supported.
[[nodiscard]] const SurfaceKernels& surface_kernels(InstructionSet set);

namespace detail {
const SurfaceKernels& avx512_surface_kernels();
const SurfaceKernels& avx2_surface_kernels();
}  // namespace detail

}  // namespace gdfmap::surface
