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

  /// Canonical text: equal options, equal text.
  [[nodiscard]] std::string canonical() const;
};

struct IngestReport {
  SourceRecord source;
  bool already_present = false;  ///< the same source was published before; nothing changed
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
/// leaves nothing visible. @param path  name of the source, for people
/// @throws Error kInterrupted when stopped, else what the reader or the store throws.
[[nodiscard]] IngestReport ingest_points(PointReader& reader, const std::string& path,
                                         const Lattice& lattice, PointStore& store,
                                         const IngestOptions& options, const RunContext& context);

}  // namespace gdfmap
