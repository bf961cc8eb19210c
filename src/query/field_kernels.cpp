#include "field_kernels_lanes.hpp"

namespace gdfmap {

const FieldKernels& field_kernels(InstructionSet set) {
  static constexpr FieldKernels portable = FieldArithmetic<PortableLanes<float, 8>>::table();
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx512) return detail::avx512_field_kernels();
  if (set == InstructionSet::kAvx2) return detail::avx2_field_kernels();
#endif
  return portable;
}

}  // namespace gdfmap
