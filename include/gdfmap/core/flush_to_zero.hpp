#pragma once

namespace gdfmap {

/// Treats denormal floats as zero in this thread while it lives, and restores the former mode. The
/// fit needs it: products of Gaussian tails are denormal and make arithmetic several times slower.
class FlushToZero {
 public:
  FlushToZero();
  ~FlushToZero();
  FlushToZero(const FlushToZero&) = delete;
  FlushToZero& operator=(const FlushToZero&) = delete;

 private:
  unsigned saved_ = 0;
};

}  // namespace gdfmap
