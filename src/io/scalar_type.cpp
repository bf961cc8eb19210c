#include "scalar_type.hpp"

#include <cstdint>

#include <gdfmap/core/bytes.hpp>

namespace gdfmap::io {
namespace {

/// Calls f with a value of the C++ type that `type` stands for, so that loops have no switch
/// inside.
template <typename F>
auto with_type(ScalarType type, const F& f) {
  switch (type) {
    case ScalarType::kInt8:
      return f(std::int8_t{});
    case ScalarType::kUint8:
      return f(std::uint8_t{});
    case ScalarType::kInt16:
      return f(std::int16_t{});
    case ScalarType::kUint16:
      return f(std::uint16_t{});
    case ScalarType::kInt32:
      return f(std::int32_t{});
    case ScalarType::kUint32:
      return f(std::uint32_t{});
    case ScalarType::kInt64:
      return f(std::int64_t{});
    case ScalarType::kUint64:
      return f(std::uint64_t{});
    case ScalarType::kFloat32:
      return f(float{});
    case ScalarType::kFloat64:
      break;
  }
  return f(double{});
}

template <typename T, std::endian kOrder>
void decode_loop(const std::byte* from, std::size_t stride, int axis, std::span<Vector3> points) {
  for (Vector3& p : points) {
    p[axis] = static_cast<double>(load<T>(from, kOrder));
    from += stride;
  }
}

}  // namespace

std::size_t size_of(ScalarType type) {
  return with_type(type, [](auto value) { return sizeof(value); });
}

bool is_integer(ScalarType type) {
  return type != ScalarType::kFloat32 && type != ScalarType::kFloat64;
}

double decode(const std::byte* from, ScalarType type, std::endian order) {
  return with_type(
      type, [&](auto value) { return static_cast<double>(load<decltype(value)>(from, order)); });
}

void decode_column(const std::byte* first, std::size_t stride, ScalarType type, std::endian order,
                   int axis, std::span<Vector3> points) {
  with_type(type, [&](auto value) {
    using T = decltype(value);
    if (order == std::endian::little) {
      decode_loop<T, std::endian::little>(first, stride, axis, points);
    } else {
      decode_loop<T, std::endian::big>(first, stride, axis, points);
    }
  });
}

}  // namespace gdfmap::io
