#include "surface_kernels_lanes.hpp"

namespace gdfmap::surface::detail {

const SurfaceKernels& avx2_surface_kernels() {
  static constexpr SurfaceKernels kernels = SurfaceArithmetic<Avx2Lanes>::table();
  return kernels;
}

}  // namespace gdfmap::surface::detail
