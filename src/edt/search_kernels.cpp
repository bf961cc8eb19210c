#include "search_kernels_lanes.hpp"

namespace gdfmap {

const SearchKernels& search_kernels(InstructionSet set) {
  static constexpr SearchKernels portable = SearchArithmetic<PortableLanes<float, 8>>::table();
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx512) return detail::avx512_search_kernels();
  if (set == InstructionSet::kAvx2) return detail::avx2_search_kernels();
#endif
  return portable;
}

}  // namespace gdfmap
