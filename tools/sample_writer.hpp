#pragma once

#include <memory>
#include <span>
#include <string>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/query/distance_field.hpp>

namespace gdfmap::cli {

/// "fine", "coarse", "far", "unknown", "pending"
[[nodiscard]] const char* status_name(FieldStatus status);

/// Writes answers of the field to standard output as they come, one row a point: x, y, z, distance,
/// gx, gy, gz, status, expected_error.
class SampleWriter {
 public:
  virtual ~SampleWriter() = default;
  virtual void write(std::span<const Vector3> points_world,
                     std::span<const FieldSample> samples) = 0;
  virtual void finish() = 0;  ///< after the last batch, also when there was none
};

/// @param format  "csv", "json" or "npy"
/// @throws Error kUsage for npy on a terminal.
[[nodiscard]] std::unique_ptr<SampleWriter> make_sample_writer(const std::string& format);

}  // namespace gdfmap::cli
