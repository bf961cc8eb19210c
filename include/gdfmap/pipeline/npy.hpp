#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace gdfmap {

/// Bytes of a NumPy array file (format 1.0): little-endian, C order.
/// @param shape  lengths of its axes; their product is values.size()
[[nodiscard]] std::string npy_bytes(std::span<const float> values,
                                    const std::vector<std::size_t>& shape);
[[nodiscard]] std::string npy_bytes(std::span<const double> values,
                                    const std::vector<std::size_t>& shape);

/// What stands before the values of a file of float64, for writers that stream the values.
[[nodiscard]] std::string npy_header_float64(const std::vector<std::size_t>& shape);

/// Writes such a file; it appears complete or not at all. @throws Error kIo
void write_npy(const std::filesystem::path& path, std::span<const float> values,
               const std::vector<std::size_t>& shape);

}  // namespace gdfmap
