#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap {

/// Streams points to a file that appears complete under its name on finish(), or not at all. Not
/// thread-safe.
class PointWriter {
 public:
  virtual ~PointWriter() = default;
  /// @throws Error kIo; kUsage for a point that LAS cannot express with the given scale and offset
  ///         (too far, or not finite).
  virtual void write(std::span<const Vector3> points) = 0;
  /// Called once, after the last write(). @throws Error kIo
  virtual void finish() = 0;
};

struct WriterOptions {
  bool double_precision = true;  ///< PLY and PCD: float64 coordinates, else float32
  double las_scale = 0.001;      ///< LAS: metres a step
  Vector3 las_offset = Vector3::Zero();
};

/// By extension, in any case: .ply (binary little-endian), .pcd (binary), .las (1.4, format 6),
/// .xyz/.txt (spaces, no header), .csv (commas, header "x,y,z"); text holds every bit of the
/// doubles. The same points and options give the same bytes.
/// @throws Error kUsage for another extension or an unusable LAS scale or offset, kIo when the file
///         cannot be created.
[[nodiscard]] std::unique_ptr<PointWriter> create_point_cloud(const std::filesystem::path& path,
                                                              const WriterOptions& options = {});

}  // namespace gdfmap
