#pragma once

#include <bit>
#include <cstddef>
#include <span>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap::io {

/// Number types that files store coordinates in.
enum class ScalarType {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64
};

[[nodiscard]] std::size_t size_of(ScalarType type);
[[nodiscard]] bool is_integer(ScalarType type);

/// One number at any address.
[[nodiscard]] double decode(const std::byte* from, ScalarType type, std::endian order);

/// Numbers that lie `stride` bytes apart into one coordinate of successive points.
void decode_column(const std::byte* first, std::size_t stride, ScalarType type, std::endian order,
                   int axis, std::span<Vector3> points);

}  // namespace gdfmap::io
