#include "kernels_lanes.hpp"

namespace gdfmap {

const FitKernels<float>& fit_kernels(InstructionSet set) {
  static constexpr FitKernels<float> portable = FitArithmetic<PortableLanes<float, 8>>::table();
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx512) return detail::avx512_fit_kernels();
  if (set == InstructionSet::kAvx2) return detail::avx2_fit_kernels();
#endif
  return portable;
}

const FitKernels<double>& reference_fit_kernels() {
  static constexpr FitKernels<double> reference = FitArithmetic<PortableLanes<double, 1>>::table();
  return reference;
}

}  // namespace gdfmap
