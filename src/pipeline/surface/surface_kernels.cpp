#include "surface_kernels_lanes.hpp"

namespace gdfmap::surface {

const SurfaceKernels& surface_kernels(InstructionSet set) {
  static constexpr SurfaceKernels portable = SurfaceArithmetic<PortableLanes<float, 8>>::table();
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx512) return detail::avx512_surface_kernels();
  if (set == InstructionSet::kAvx2) return detail::avx2_surface_kernels();
#endif
  return portable;
}

}  // namespace gdfmap::surface
