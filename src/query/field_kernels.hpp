#pragma once

#include <cstddef>
#include <cstdint>

#include <gdfmap/core/instruction_set.hpp>

namespace gdfmap {

/// One cube's part in the field at a point: d = Σ weight · d_c over the terms of the point.
struct KernelTerm {
  /// Seven rows (GaussianRow, with 1/s⁴ in place of s), `stride` apart, each on 32 bytes.
  const float* rows;
  std::uint32_t stride;  ///< Gaussians in a row, those that fill it up included; a multiple of 8
  float p_local[3];      ///< from the cube's minimum corner, metres
  float weight;
  float weight_gradient[3];  ///< 1/m
};

/// Float kernels of one instruction set. Point i has the terms [ends[i − 1], ends[i]), the first
/// one those from 0. A point's answer depends on its terms alone, and values() gives the same
/// values as values_and_gradients().
struct FieldKernels {
  void (*values)(const KernelTerm* terms, const std::uint32_t* ends, std::size_t num_points,
                 float* values);
  /// Value, then the gradient of Σ weight · d_c by the product rule.
  void (*values_and_gradients)(const KernelTerm* terms, const std::uint32_t* ends,
                               std::size_t num_points, float (*value_gradients)[4]);
};

/// The set must be supported.
[[nodiscard]] const FieldKernels& field_kernels(InstructionSet set);

namespace detail {
const FieldKernels& avx512_field_kernels();
const FieldKernels& avx2_field_kernels();
}  // namespace detail

}  // namespace gdfmap
