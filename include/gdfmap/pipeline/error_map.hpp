#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include <gdfmap/pipeline/evaluate.hpp>

namespace gdfmap {

/// Streams judged samples to a binary little-endian PLY file, which appears complete or not at all.
/// Properties: x, y, z (double, metres), red, green, blue (uchar), error (float, metres: stated
/// less true distance, NaN where the field states none), distance (float, metres, the true one),
/// weight (float, m³), level (char, −1 where no level has a cube), status (uchar: 0 fine, 1 coarse,
/// 2 far, 3 unknown). Colours run from dark violet where the error is up to a thousandth of the
/// cube size to light yellow at a tenth, by its logarithm; grey where no distance is stated. The
/// same samples give the same bytes. Not thread-safe.
class ErrorMapWriter {
 public:
  /// @param cube_size  metres @throws Error kUsage for another extension than .ply, kIo.
  ErrorMapWriter(const std::filesystem::path& path, double cube_size);
  ~ErrorMapWriter();
  ErrorMapWriter(const ErrorMapWriter&) = delete;
  ErrorMapWriter& operator=(const ErrorMapWriter&) = delete;

  /// @throws Error kIo
  void add(std::span<const JudgedSample> samples);
  /// Called once, after the last add(). @throws Error kIo
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gdfmap
