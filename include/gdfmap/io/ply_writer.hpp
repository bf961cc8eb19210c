#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace gdfmap {

/// What the vertices of a PLY file carry.
struct PlyFormat {
  std::vector<std::string> properties;  ///< type and name, "double x", in the order of a record
  bool has_triangles = false;
  std::string comment = {};  ///< one line; empty: none
};

/// Streams a binary little-endian PLY file that appears complete under its name on finish(), or not
/// at all. Triangles stand behind all vertices in the file: until finish() they are kept in a
/// nameless file beside it. Not thread-safe.
/// @throws Error kIo (path and system message) from every member that writes.
class PlyWriter {
 public:
  PlyWriter(const std::filesystem::path& path, const PlyFormat& format);
  ~PlyWriter();
  PlyWriter(PlyWriter&&) noexcept;
  PlyWriter& operator=(PlyWriter&&) noexcept;

  /// @param records  `count` vertices, each its properties without gaps, little-endian
  void write_vertices(std::span<const std::byte> records, std::uint64_t count);
  /// Indices of vertices from 0, in the order in which they were written or will be.
  /// @throws Error kUsage for an index that the format's 31 bits do not hold
  void write_triangles(std::span<const std::array<std::uint64_t, 3>> triangles);
  /// Called once, after everything else.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gdfmap
