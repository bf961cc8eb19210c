#include <gdfmap/core/lattice.hpp>

#include "field_kernels_lanes.hpp"

namespace gdfmap {

static_assert(kMaxKernelLevels == kMaxLevels);

const FieldKernels<float>& field_kernels(InstructionSet set) {
  static constexpr FieldKernels<float> portable = FieldArithmetic<PortableLanes<float, 8>>::table();
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx512) return detail::avx512_field_kernels();
  if (set == InstructionSet::kAvx2) return detail::avx2_field_kernels();
#endif
  return portable;
}

const FieldKernels<double>& exact_field_kernels() {
  static constexpr FieldKernels<double> kernels =
      FieldArithmetic<PortableLanes<double, 1>>::table();
  return kernels;
}

}  // namespace gdfmap
