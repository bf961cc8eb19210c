// One program for each target: GDFMAP_FUZZ_TARGET names its function.

#include <cstdint>

#include "targets.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static_cast<void>(
      gdfmap::fuzz::GDFMAP_FUZZ_TARGET(std::as_bytes(std::span<const std::uint8_t>(data, size))));
  return 0;
}
