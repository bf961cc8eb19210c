#include <initializer_list>

#include <gdfmap/core/instruction_set.hpp>

namespace gdfmap {

bool is_supported(InstructionSet set) {
  if (set == InstructionSet::kPortable) return true;
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx2) {
    return __builtin_cpu_supports("avx2") > 0 && __builtin_cpu_supports("fma") > 0;
  }
  return __builtin_cpu_supports("avx512f") > 0 && __builtin_cpu_supports("avx512dq") > 0;
#else
  return false;
#endif
}

InstructionSet best_instruction_set() {
  for (const InstructionSet set : {InstructionSet::kAvx512, InstructionSet::kAvx2}) {
    if (is_supported(set)) return set;
  }
  return InstructionSet::kPortable;
}

const char* name_of(InstructionSet set) {
  switch (set) {
    case InstructionSet::kAvx512:
      return "AVX-512";
    case InstructionSet::kAvx2:
      return "AVX2";
    case InstructionSet::kPortable:
      break;
  }
  return "portable";
}

}  // namespace gdfmap
