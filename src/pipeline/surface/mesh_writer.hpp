#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "projector.hpp"

namespace gdfmap::surface {

/// Streams a mesh to a file that appears complete under its name on finish(), or not at all. Every
/// vertex is written before the triangles that have it. Not thread-safe.
/// @throws Error kIo from every member that writes
class MeshWriter {
 public:
  virtual ~MeshWriter() = default;
  virtual void write(std::span<const ProjectedPoint> vertices,
                     std::span<const std::array<std::uint64_t, 3>> triangles) = 0;
  virtual void finish() = 0;
};

/// By extension: .ply (binary little-endian) or .obj. @throws Error kUsage for another one; kIo
[[nodiscard]] std::unique_ptr<MeshWriter> create_mesh(const std::filesystem::path& path);

}  // namespace gdfmap::surface
