#pragma once

namespace gdfmap {

/// Which vector instructions the hot loops use; chosen at run time. Trained bytes are the same for
/// all of them.
enum class InstructionSet {
  kPortable,  ///< any machine
  kAvx2,      ///< x86-64 with AVX2 and FMA
  kAvx512,    ///< x86-64 with AVX-512 F and DQ
};

/// Whether this build holds code for a set and this processor can run it.
[[nodiscard]] bool is_supported(InstructionSet set);

/// The best supported set.
[[nodiscard]] InstructionSet best_instruction_set();

/// "portable", "AVX2", "AVX-512".
[[nodiscard]] const char* name_of(InstructionSet set);

}  // namespace gdfmap
