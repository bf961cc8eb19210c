#include "kernels_lanes.hpp"

namespace gdfmap::detail {

const FitKernels<float>& avx2_fit_kernels(const TrainingGrid& grid) {
  return kernels_for<Avx2Lanes>(grid);
}

}  // namespace gdfmap::detail
