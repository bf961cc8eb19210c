#include "field_kernels_lanes.hpp"

namespace gdfmap::detail {

const FieldKernels& avx2_field_kernels() {
  static constexpr FieldKernels kernels = FieldArithmetic<Avx2Lanes>::table();
  return kernels;
}

}  // namespace gdfmap::detail
