#include "kernels_lanes.hpp"

namespace gdfmap {

const FitKernels<float>& fit_kernels(InstructionSet set, const TrainingGrid& grid) {
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx512) return detail::avx512_fit_kernels(grid);
  if (set == InstructionSet::kAvx2) return detail::avx2_fit_kernels(grid);
#endif
  return kernels_for<PortableLanes<float, 8>>(grid);
}

const FitKernels<double>& reference_fit_kernels(const TrainingGrid& grid) {
  return kernels_for<PortableLanes<double, 1>>(grid);
}

}  // namespace gdfmap
