#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "input_file.hpp"
#include "scalar_type.hpp"

namespace gdfmap::io {

enum class PcdEncoding { kAscii, kBinary, kBinaryCompressed };

/// A field with the values that old files leave out.
struct PcdField {
  std::string name;
  std::size_t size = 4;  ///< bytes of one value: 1, 2, 4 or 8
  char type = 'F';       ///< F, I or U
  std::size_t count = 1;

  [[nodiscard]] std::size_t bytes() const { return size * count; }
  /// Of one value; empty for a size that its type does not have.
  [[nodiscard]] std::optional<ScalarType> scalar_type() const;
  /// "_": bytes that stand for nothing.
  [[nodiscard]] bool is_padding() const { return name == "_"; }
};

struct PcdHeader {
  std::vector<PcdField> fields;
  std::uint64_t num_points = 0;
  PcdEncoding encoding = PcdEncoding::kAscii;
  /// VIEWPOINT: three numbers of place and a quaternion, w first; empty unless it says anything.
  std::optional<std::array<double, 7>> viewpoint;
};

/// Reads up to and including the line DATA. A record of all fields is ≤ InputFile::kMaxPeekBytes.
/// @throws Error kCorrupt with the number of the line.
[[nodiscard]] PcdHeader read_pcd_header(InputFile& file);

/// The indices in `fields` of x, y and z (any case), whose scalar_type() is set.
/// @throws Error kCorrupt when one of them is missing or of an unknown type.
[[nodiscard]] std::array<std::size_t, 3> find_pcd_coordinates(const InputFile& file,
                                                              const std::vector<PcdField>& fields);

}  // namespace gdfmap::io
