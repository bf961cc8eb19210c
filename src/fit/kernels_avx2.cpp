#include "kernels_lanes.hpp"

namespace gdfmap::detail {

const FitKernels<float>& avx2_fit_kernels() {
  static constexpr FitKernels<float> kernels = FitArithmetic<Avx2Lanes>::table();
  return kernels;
}

}  // namespace gdfmap::detail
