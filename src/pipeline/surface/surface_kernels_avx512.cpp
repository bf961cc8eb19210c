#include "surface_kernels_lanes.hpp"

namespace gdfmap::surface::detail {

const SurfaceKernels& avx512_surface_kernels() {
  static constexpr SurfaceKernels kernels = SurfaceArithmetic<Avx512Lanes>::table();
  return kernels;
}

}  // namespace gdfmap::surface::detail
