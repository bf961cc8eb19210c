#pragma once

#include <cstddef>
#include <cstdint>

#include <gdfmap/core/instruction_set.hpp>

namespace gdfmap {

/// Points that a kernel takes together, all of one zone on every level.
inline constexpr std::size_t kPacketSize = 8;
/// A copy of kMaxLevels for files that must not know Eigen.
inline constexpr std::size_t kMaxKernelLevels = 3;

struct KernelCube {
  /// Seven rows (GaussianRow, with 1/s⁴ in place of s), `stride` apart, each on 32 bytes, filled up
  /// with Gaussians that are zero everywhere; null for a cube that is missing.
  const float* rows = nullptr;
  std::uint32_t stride = 0;  ///< a multiple of 8
  std::uint32_t count = 0;   ///< Gaussians, without those that fill a row up
  float mae = 0.0f;          ///< metres
  float max_error = 0.0f;    ///< metres
};

/// The cubes of a level that share the points of a zone.
struct KernelLevel {
  double edge, margin;  ///< metres
  std::uint8_t counts[3];
  KernelCube cubes[8];  ///< counts[0] · counts[1] · counts[2] of them, x outermost
};

/// The points of one zone of each level.
template <typename Number>
struct KernelPacket {
  const KernelLevel* levels;
  std::size_t num_levels;  ///< some cube is missing on all of them but the last
  bool is_fine;            ///< one level, and none is missing
  std::size_t num_points;
  /// Coordinates from the minimum corner of the level's first cube, metres; beyond num_points
  /// anything finite.
  alignas(32) Number p_local[kMaxKernelLevels][3][kPacketSize];
};

/// Of each point the sums over its cubes, and what they leave to the far bound, which is set unless
/// the packet is fine.
template <typename Number>
struct KernelSums {
  alignas(32) Number distance[kPacketSize];
  Number gradient[3][kPacketSize];
  Number mae[kPacketSize];
  Number max_error[kPacketSize];
  Number weight[kPacketSize];
  Number share[kPacketSize];  ///< 1 − weight, exactly 0 where no cube of a level is missing
  Number share_gradient[3][kPacketSize];
};

/// Kernels of one arithmetic. A point's sums depend on its cubes alone, not on the points beside
/// it. distances() gives the same sums but leaves gradients as they are.
template <typename Number>
struct FieldKernels {
  void (*distances)(const KernelPacket<Number>& packet, KernelSums<Number>& sums);
  void (*distances_and_gradients)(const KernelPacket<Number>& packet, KernelSums<Number>& sums);
};

/// The set must be supported.
[[nodiscard]] const FieldKernels<float>& field_kernels(InstructionSet set);
/// The reference.
[[nodiscard]] const FieldKernels<double>& exact_field_kernels();

namespace detail {
const FieldKernels<float>& avx512_field_kernels();
const FieldKernels<float>& avx2_field_kernels();
}  // namespace detail

}  // namespace gdfmap
