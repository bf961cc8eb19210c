#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>

#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/hash.hpp>
#include <gdfmap/gdf1/model.hpp>

#include "placement.hpp"

namespace gdfmap::gdf1 {

/// What writers of both formats share: the file, its digest, and the order in which it and its
/// sidecar appear under their names.
class ModelOutput {
 public:
  /// @throws Error kUsage for a cube size or shift that cannot be used, kIo.
  ModelOutput(const std::filesystem::path& path, ModelFormat format, double cube_size,
              const Vector3& shift, const Digest& content_digest);

  [[nodiscard]] const Placement& placement() const { return placement_; }
  /// Where the cube stands. @throws Error kUsage as ModelWriter::write; kInternal for a cube that
  /// must not be written (level, no Gaussians).
  [[nodiscard]] std::array<float, 3> admit(const Gdf1Cube& cube);

  /// Appends bytes that the digest covers.
  void append(std::span<const std::byte> bytes);
  /// Bytes in front of digest_offset(), at any time.
  void write_front(std::span<const std::byte> bytes) { file_.write_at(0, bytes); }
  /// @throws Error kInternal when the header does not speak of what was written, kIo.
  void publish(const Gdf1Header& header);

 private:
  std::filesystem::path path_;
  Placement placement_;
  Digest content_digest_;
  AtomicFile file_;
  StreamHasher hasher_;
  std::uint64_t num_cubes_ = 0;
};

}  // namespace gdfmap::gdf1
