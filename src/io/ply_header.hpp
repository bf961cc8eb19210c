#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "input_file.hpp"
#include "scalar_type.hpp"

namespace gdfmap::io {

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };

struct PlyProperty {
  std::string name;
  ScalarType type = ScalarType::kFloat32;  ///< of the value, or of the list's items
  std::optional<ScalarType> list_length;   ///< set for lists
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;  ///< in file order
};

/// Reads up to and including the line "end_header".
/// @throws Error kCorrupt with the number of the line.
[[nodiscard]] PlyHeader read_ply_header(InputFile& file);

}  // namespace gdfmap::io
