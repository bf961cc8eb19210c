#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/tiling/point_store.hpp>

namespace gdfmap {

/// How registration moves a cloud onto the map.
struct Alignment {
  std::string method;  ///< by which it is asked for: part of the source's identity
  /// Applied after the transform of the options; what was found, hence no part of the identity.
  Eigen::Isometry3d T_map_nominal = Eigen::Isometry3d::Identity();
  double inlier_ratio = 0.0;
  double rmse = 0.0;  ///< of the inliers, metres

  /// "method=ndt T_map_nominal=…,… inlier_ratio=… rmse=…": kept with the source.
  [[nodiscard]] std::string text() const;
};

struct IngestOptions {
  PointTransform transform;  ///< file frame and units to the map's
  std::optional<Alignment> alignment = std::nullopt;
  /// Where the sensor stood, in the file's frame and units: it moves with the points. Empty: what
  /// the file states. Kept with the source, no part of its identity.
  std::optional<Vector3> sensor_origin_source = std::nullopt;
  bool drop_zero = false;  ///< reject points that are exactly (0, 0, 0) in the file
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
  /// `transform`, and `alignment` after it.
  [[nodiscard]] PointTransform aligned_transform() const;
};

struct IngestReport {
  SourceRecord source;
  bool already_present = false;        ///< the same source was published before and stays as it was
  bool sensor_origin_changed = false;  ///< of a source that was there already: it has another now
  std::uint64_t num_zero = 0;          ///< points read that are exactly (0, 0, 0), dropped or not
};

/// The published source that a file is, with these options; found by size first, so that most files
/// need not be read. Empty for what is not a regular file.
[[nodiscard]] std::optional<SourceRecord> find_published(const std::string& path,
                                                         const IngestOptions& options,
                                                         PointStore& store,
                                                         const RunContext& context);

/// The clouds of one survey: staged one after the other, and visible all at once or not at all. Not
/// thread-safe.
class SurveyIngest {
 public:
  /// All of them outlive this object.
  SurveyIngest(const Lattice& lattice, PointStore& store, const RunContext& context)
      : lattice_(&lattice), store_(&store), context_(&context) {}
  /// Discards what was staged and not published.
  ~SurveyIngest();
  SurveyIngest(const SurveyIngest&) = delete;
  SurveyIngest& operator=(const SurveyIngest&) = delete;

  /// Streams a cloud into the store, where nobody sees it yet: as ingest_points() does it, which
  /// says what it throws; the survey is then of no more use. All options name the same replaced
  /// source, or none.
  void stage(PointReader& reader, const std::string& path, const IngestOptions& options);

  /// Makes every staged cloud visible, in one transaction, and tells of each, in order. Call it
  /// once. @throws Error as PointStore::publish does
  [[nodiscard]] std::vector<IngestReport> publish();

 private:
  [[nodiscard]] std::optional<SourceRecord> find(const Digest& identity) const;

  const Lattice* lattice_;
  PointStore* store_;
  const RunContext* context_;
  std::vector<IngestReport> reports_;
  std::optional<std::int64_t> replaced_;
};

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
