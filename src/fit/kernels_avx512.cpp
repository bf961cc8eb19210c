#include "kernels_lanes.hpp"

namespace gdfmap::detail {

const FitKernels<float>& avx512_fit_kernels(const TrainingGrid& grid) {
  return kernels_for<Avx512Lanes>(grid);
}

}  // namespace gdfmap::detail
