#include <gdfmap/core/flush_to_zero.hpp>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace gdfmap {

#if defined(__SSE2__)
namespace {
constexpr unsigned kFlushToZeroBit = 0x8000;
constexpr unsigned kDenormalsAreZeroBit = 0x0040;
}  // namespace

FlushToZero::FlushToZero() : saved_(_mm_getcsr()) {
  _mm_setcsr(saved_ | kFlushToZeroBit | kDenormalsAreZeroBit);
}
FlushToZero::~FlushToZero() { _mm_setcsr(saved_); }
#else
FlushToZero::FlushToZero() = default;
FlushToZero::~FlushToZero() = default;
#endif

}  // namespace gdfmap
