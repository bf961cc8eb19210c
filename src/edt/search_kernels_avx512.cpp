#include "search_kernels_lanes.hpp"

namespace gdfmap::detail {

const SearchKernels& avx512_search_kernels() {
  static constexpr SearchKernels kernels = SearchArithmetic<Avx512Lanes>::table();
  return kernels;
}

}  // namespace gdfmap::detail
