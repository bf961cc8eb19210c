#include "kernels_lanes.hpp"

namespace gdfmap::detail {

const FitKernels<float>& avx512_fit_kernels() {
  static constexpr FitKernels<float> kernels = FitArithmetic<Avx512Lanes>::table();
  return kernels;
}

}  // namespace gdfmap::detail
