#include "search_kernels_lanes.hpp"

namespace gdfmap::detail {

const SearchKernels& avx2_search_kernels() {
  static constexpr SearchKernels kernels = SearchArithmetic<Avx2Lanes>::table();
  return kernels;
}

}  // namespace gdfmap::detail
