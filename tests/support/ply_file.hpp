#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap::test {

/// What a binary little-endian PLY file holds, read by its header alone, without the library's own
/// reader.
struct PlyFile {
  std::vector<std::string> properties;                ///< of a vertex, in file order
  std::map<std::string, std::vector<double>> values;  ///< of the vertices, by property
  std::vector<std::array<std::int64_t, 3>> triangles;

  [[nodiscard]] std::size_t num_vertices() const { return values.at("x").size(); }
  [[nodiscard]] std::vector<Vector3> positions() const { return vectors("x", "y", "z"); }
  [[nodiscard]] std::vector<Vector3> vectors(const char* x, const char* y, const char* z) const;
};

/// @throws std::runtime_error for a file that is anything else, or has bytes left at its end
[[nodiscard]] PlyFile read_ply(const std::filesystem::path& path);

}  // namespace gdfmap::test
