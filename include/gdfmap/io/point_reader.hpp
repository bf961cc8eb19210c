#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/hash.hpp>

namespace gdfmap {

/// What a cloud says of itself before its points are read.
struct CloudInfo {
  std::string
      format;  ///< e.g. "PLY binary_little_endian", "PCD binary_compressed", "LAS 1.4 format 7"
  std::optional<std::uint64_t>
      num_points;  ///< as declared, withheld ones included; XYZ declares none
  /// Where the sensor stood, in the file's frame and units (PCD: VIEWPOINT, unless it is the one
  /// that every writer puts there).
  std::optional<Vector3> sensor_origin = std::nullopt;
  /// The file states how the sensor was turned as well. Points are given as they stand.
  bool has_sensor_rotation = false;
};

/// Streams the points of one cloud, in file order, in bounded memory. Not thread-safe.
class PointReader {
 public:
  virtual ~PointReader() = default;

  [[nodiscard]] virtual const CloudInfo& info() const = 0;

  /// Fills the front of `points` (file frame, file units, double precision; not-a-number and
  /// infinite coordinates as they stand) and returns how many; 0 means the end.
  /// @throws Error kIo or kCorrupt with path and place; a truncated file throws here, never earlier
  ///         points silently.
  [[nodiscard]] virtual std::size_t read(std::span<Vector3> points) = 0;

  /// Points that the file itself marks as withheld (LAS), passed over so far.
  [[nodiscard]] virtual std::uint64_t num_withheld() const { return 0; }

  /// Share of the file's bytes that was consumed so far, 0 to 1; empty where its size is not known.
  [[nodiscard]] virtual std::optional<double> fraction_read() const { return std::nullopt; }

  /// XXH3-128 of all bytes of the file. Call it last: it consumes what is left, nothing can be read
  /// afterwards.
  [[nodiscard]] virtual Digest identity() = 0;
  /// Bytes of the whole file; valid after identity().
  [[nodiscard]] virtual std::uint64_t num_bytes() const = 0;
};

/// Opens PLY, PCD, LAS or XYZ/CSV. The format is found from the first bytes, not from the name; "-"
/// is standard input (PCD binary_compressed cannot be streamed from there).
/// @throws Error kIo when it cannot be read; kCorrupt when the header is damaged, counts do not fit
/// the
///         file, or the format is not one of these. LAZ is refused by a message that names the
///         remedy.
[[nodiscard]] std::unique_ptr<PointReader> open_point_cloud(const std::filesystem::path& path);

}  // namespace gdfmap
