#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <gdfmap/align/registration.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/map/map.hpp>
#include <gdfmap/tiling/ingest.hpp>

namespace gdfmap {

/// When a cloud is aligned well enough to be ingested. Lengths in metres.
struct AlignmentOptions {
  std::string method = "auto";  ///< one of registration_method_names()
  RegistrationOptions
      registration;  ///< its voxel grows with clouds too large to be sampled so finely
  std::size_t max_sample_points = std::size_t{1} << 19;  ///< of a cloud, for registration
  double max_rmse_over_noise = 2.0;
  /// Between the pose and the one that registering the map onto the scan gives.
  double max_backward_translation = 0.02, max_backward_rotation_deg = 0.1;
  /// Clouds of several patches with this edge are checked patch by patch: a patch disagrees if the
  /// pose of the whole puts its surfaces off from where its own pose has them, as the root mean
  /// square along their normals, by more than this many times the noise.
  double patch_size = 10.0, max_patch_shift_over_noise = 1.5;
  double min_patch_agreement = 0.8;  ///< share of the patches that have a pose of their own
};

/// What became of the alignment of one cloud.
struct AlignmentReport {
  std::string path;
  std::string method;
  bool accepted = false;
  std::string reason;  ///< why it is not accepted, one line
  /// T_target_source moves points that went through the options' transform.
  RegistrationResult registration;
  double noise =
      0.0;  ///< of the map's surface or the scan's, whichever is more, as rmse measures it
  double backward_translation = 0.0, backward_rotation_deg = 0.0;
  /// How far the pose of the whole puts the surfaces of a patch off, for every patch with a pose of
  /// its own, ascending, metres; empty for a cloud of one patch.
  std::vector<double> patch_shifts;
  std::size_t num_tiles_left_out = 0;  ///< of the map around a cloud too large to be seen at once
};

/// Least memory budget of ingest_aligned(), which looks at as much of a map whatever the budget: a
/// pose must not depend on it.
inline constexpr std::size_t kMinAlignmentMemory = std::size_t{512} << 20;

struct AlignedIngestReport {
  std::vector<AlignmentReport> alignments;  ///< of the clouds that were not there already
  std::vector<IngestReport> sources;        ///< of every cloud; empty: nothing was published
  [[nodiscard]] bool accepted() const { return !sources.empty(); }
};

/// Registers clouds with the map and ingests them where they fit: all of them, in one transaction,
/// or none. Each is read twice: a bounded sample for registration, then every point, moved as was
/// found. What is asked for is part of a source's identity, what is found is not: the same clouds
/// again change nothing and are not registered again. Memory is bounded, as for ingest().
/// @param options  one for each cloud; the transform is the first guess
/// @throws Error kUsage for standard input, which cannot be read twice, for a replaced source,
/// which
///         the cloud would be aligned with, for an unknown method and for a budget below
///         kMinAlignmentMemory; as ingest() and Map::points() do.
[[nodiscard]] AlignedIngestReport ingest_aligned(std::span<const std::filesystem::path> clouds,
                                                 std::span<const IngestOptions> options, Map& map,
                                                 const AlignmentOptions& alignment,
                                                 const RunContext& context = {});

}  // namespace gdfmap
