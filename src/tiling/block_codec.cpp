#include <array>

#include <lz4.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/tiling/block_codec.hpp>

// The bytes are specified in schema/block_format.md.

namespace gdfmap {
namespace {

constexpr std::uint8_t kFormat = 1;
constexpr std::uint8_t kStored = 0;
constexpr std::uint8_t kLz4 = 1;
constexpr std::size_t kBytesPerPoint = 6;

using Axis = std::uint16_t TileOffset::*;
constexpr std::array<Axis, 3> kAxes{&TileOffset::x, &TileOffset::y, &TileOffset::z};

[[noreturn]] void refuse(const char* reason) {
  throw Error(ErrorCode::kCorrupt, std::string("point block: ") + reason);
}

/// Differences of either sign to small unsigned numbers: 0, -1, 1, -2, ... to 0, 1, 2, 3, ...
constexpr std::uint16_t fold(std::uint16_t difference) {
  return static_cast<std::uint16_t>(difference << 1 ^ -(difference >> 15));
}

constexpr std::uint16_t unfold(std::uint16_t folded) {
  return static_cast<std::uint16_t>(folded >> 1 ^ -(folded & 1));
}

/// Writes the two planes of an axis.
void split_axis(std::span<const TileOffset> points, Axis axis, std::byte* planes) {
  std::uint16_t previous = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint16_t value = points[i].*axis;
    const std::uint16_t folded = fold(static_cast<std::uint16_t>(value - previous));
    planes[i] = static_cast<std::byte>(folded & 0xff);
    planes[points.size() + i] = static_cast<std::byte>(folded >> 8);
    previous = value;
  }
}

void join_axis(const std::byte* planes, Axis axis, std::span<TileOffset> points) {
  std::uint16_t value = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto low = std::to_integer<unsigned>(planes[i]);
    const auto high = std::to_integer<unsigned>(planes[points.size() + i]);
    value = static_cast<std::uint16_t>(value + unfold(static_cast<std::uint16_t>(low | high << 8)));
    points[i].*axis = value;
  }
}

/// LZ4 of the planes, or nothing where that would not be shorter.
Bytes compress(const Bytes& planes) {
  Bytes packed(planes.size() - 1);
  const int size = LZ4_compress_default(
      reinterpret_cast<const char*>(planes.data()), reinterpret_cast<char*>(packed.data()),
      static_cast<int>(planes.size()), static_cast<int>(packed.size()));
  packed.resize(static_cast<std::size_t>(size));
  return packed;
}

Bytes decompress(std::span<const std::byte> payload, std::size_t num_bytes) {
  if (payload.size() >= num_bytes) refuse("longer than its points");
  Bytes planes(num_bytes);
  const int size = LZ4_decompress_safe(
      reinterpret_cast<const char*>(payload.data()), reinterpret_cast<char*>(planes.data()),
      static_cast<int>(payload.size()), static_cast<int>(planes.size()));
  if (size != static_cast<int>(num_bytes)) refuse("the compressed points are damaged");
  return planes;
}

/// morton_code(p) < morton_code(q) without forming the codes or branching: this check is a good
/// part of decoding. The axis whose coordinates differ in the highest bit decides, z before y
/// before x.
bool in_morton_order(const TileOffset& p, const TileOffset& q) {
  const auto differs_higher = [](unsigned a, unsigned b) { return b < (a & ~b); };
  const unsigned dx = p.x ^ q.x;
  const unsigned dy = p.y ^ q.y;
  const unsigned dz = p.z ^ q.z;
  const bool y_over_z = differs_higher(dy, dz);
  const bool x_over_both = differs_higher(dx, dz) & differs_higher(dx, dy);
  const bool less_in_yz = (y_over_z & (p.y < q.y)) | (!y_over_z & (p.z < q.z));
  return (x_over_both & (p.x < q.x)) | (!x_over_both & less_in_yz);
}

void check_order(std::span<const TileOffset> points) {
  bool ascending = true;
  for (std::size_t i = 1; i < points.size(); ++i) {
    ascending &= in_morton_order(points[i - 1], points[i]);
  }
  if (!ascending) refuse("the points are not in order");
}

}  // namespace

Bytes encode_block(std::span<const TileOffset> points) {
  if (points.empty() || points.size() > kMaxBlockPoints) {
    throw Error(ErrorCode::kInternal,
                "a block cannot hold " + std::to_string(points.size()) + " points");
  }
  Bytes planes(points.size() * kBytesPerPoint);
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    split_axis(points, kAxes[axis], planes.data() + 2 * axis * points.size());
  }
  const Bytes packed = compress(planes);
  ByteWriter writer;
  writer.put(kFormat);
  writer.put(packed.empty() ? kStored : kLz4);
  writer.put(static_cast<std::uint16_t>(points.size() - 1));
  writer.put_bytes(packed.empty() ? planes : packed);
  return writer.take();
}

std::vector<TileOffset> decode_block(std::span<const std::byte> bytes) {
  ByteReader reader(bytes, "point block");
  if (reader.get<std::uint8_t>() != kFormat) refuse("unknown format");
  const auto packing = reader.get<std::uint8_t>();
  const std::size_t num_points = std::size_t{reader.get<std::uint16_t>()} + 1;
  const std::size_t num_bytes = num_points * kBytesPerPoint;
  const std::span<const std::byte> payload = reader.get_bytes(reader.remaining());
  if (packing > kLz4) refuse("unknown packing");
  if (packing == kStored && payload.size() != num_bytes) refuse("its size does not fit its points");

  const Bytes unpacked = packing == kLz4 ? decompress(payload, num_bytes) : Bytes();
  const std::byte* const planes = packing == kLz4 ? unpacked.data() : payload.data();
  std::vector<TileOffset> points(num_points);
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    join_axis(planes + 2 * axis * num_points, kAxes[axis], points);
  }
  check_order(points);
  return points;
}

}  // namespace gdfmap
