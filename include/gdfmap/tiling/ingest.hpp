#pragma once

#include <optional>
#include <string>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/tiling/point_store.hpp>

namespace gdfmap {

struct IngestOptions {
  PointTransform transform;  ///< file frame and units to the map's
  bool drop_zero = false;    ///< reject points that are exactly (0, 0, 0) in the file
  /// Reject points outside [min, max), in the map's frame, metres, before they are rounded.
  std::optional<Box3> region;
  /// Edge of the voxels that keep one point each, in metres, from a quantisation step to the edge
  /// of a cube, rounded to whole steps; 0 keeps every point. All sources of one size are thinned
  /// together.
  double voxel_size = 0.0;
  /// Source that vanishes in the transaction that publishes the new one; no part of the identity.
  std::optional<std::int64_t> replaced_source;

  /// Canonical text of what is part of a source's identity: equal options, equal text.
  [[nodiscard]] std::string canonical() const;
};

struct IngestReport {
  SourceRecord source;
  bool already_present = false;  ///< the same source was published before and stays as it was
  std::uint64_t num_zero = 0;    ///< points read that are exactly (0, 0, 0), dropped or not
};

/// The published source that a file is, with these options; found by size first, so that most files
/// need not be read. Empty for what is not a regular file.
[[nodiscard]] std::optional<SourceRecord> find_published(const std::string& path,
                                                         const IngestOptions& options,
                                                         PointStore& store,
                                                         const RunContext& context);

/// Streams a cloud into the store: quantise, collect per tile, write full buffers as blocks,
/// publish. Memory is bounded by context.memory() whatever the cloud. Interrupted or failed, it
/// leaves everything as it was. @param path  name of the source, for people
/// @throws Error kInterrupted when stopped, kUsage for options that cannot be used or a replaced
///         source that is not there, kIo when the disk has no room for the points that the cloud
///         declares, else what the reader or the store throws.
[[nodiscard]] IngestReport ingest_points(PointReader& reader, const std::string& path,
                                         const Lattice& lattice, PointStore& store,
                                         const IngestOptions& options, const RunContext& context);

}  // namespace gdfmap
