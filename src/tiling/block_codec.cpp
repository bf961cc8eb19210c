#include <array>

#include <gdfmap/core/error.hpp>
#include <gdfmap/tiling/block_codec.hpp>

#include "length_code.hpp"

// The bytes are specified in schema/block_format.md.

namespace gdfmap {
namespace {

constexpr std::uint8_t kFormat = 2;
constexpr std::uint8_t kStored = 0;
constexpr std::uint8_t kCoded = 1;
constexpr std::size_t kBytesPerPoint = 6;
constexpr std::size_t kCodeBytes = (3 * kNumLengths + 1) / 2;

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

std::vector<std::uint16_t> differences(std::span<const TileOffset> points, Axis axis) {
  std::vector<std::uint16_t> folded(points.size());
  std::uint16_t previous = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint16_t value = points[i].*axis;
    folded[i] = fold(static_cast<std::uint16_t>(value - previous));
    previous = value;
  }
  return folded;
}

using CodesOfAxes = std::array<CodeBits, 3>;

/// Two numbers a byte, the first in the lower half.
void put_codes(ByteWriter& writer, const CodesOfAxes& codes) {
  std::array<std::uint8_t, kCodeBytes> bytes{};
  std::size_t place = 0;
  for (const CodeBits& code : codes) {
    for (const std::uint8_t bits : code) {
      bytes[place / 2] |= static_cast<std::uint8_t>(bits << (place % 2 * 4));
      ++place;
    }
  }
  writer.put_bytes(std::as_bytes(std::span(bytes)));
}

CodesOfAxes get_codes(ByteReader& reader) {
  const auto bytes = reader.get_bytes(kCodeBytes);
  CodesOfAxes codes;
  std::size_t place = 0;
  for (CodeBits& code : codes) {
    for (std::uint8_t& bits : code) {
      bits = std::to_integer<std::uint8_t>(bytes[place / 2]) >> (place % 2 * 4) & 0xf;
      ++place;
    }
  }
  if (std::to_integer<unsigned>(bytes.back()) >> 4 != 0) refuse("its codes are damaged");
  return codes;
}

Bytes coded(std::span<const TileOffset> points) {
  CodesOfAxes codes;
  std::array<std::uint32_t, 3> num_bytes{};
  Bytes streams;
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    const std::vector<std::uint16_t> numbers = differences(points, kAxes[axis]);
    codes[axis] = code_bits_for(numbers);
    const std::size_t before = streams.size();
    put_stream(numbers, codes[axis], streams);
    num_bytes[axis] = static_cast<std::uint32_t>(streams.size() - before);
  }
  ByteWriter writer;
  put_codes(writer, codes);
  writer.put(num_bytes[0]);
  writer.put(num_bytes[1]);
  writer.put_bytes(streams);
  return writer.take();
}

void decode_coded(ByteReader& reader, std::span<TileOffset> points) {
  const CodesOfAxes codes = get_codes(reader);
  std::array<std::size_t, 3> num_bytes{};
  num_bytes[0] = reader.get<std::uint32_t>();
  num_bytes[1] = reader.get<std::uint32_t>();
  const std::span<const std::byte> rest = reader.get_bytes(reader.remaining());
  if (num_bytes[0] + num_bytes[1] > rest.size()) refuse("truncated");
  num_bytes[2] = rest.size() - num_bytes[0] - num_bytes[1];
  Bytes streams(rest.begin(), rest.end());
  streams.resize(rest.size() + StreamReader::kPadding);

  const std::byte* const begin = streams.data();
  auto x = StreamReader::open(begin, num_bytes[0], codes[0]);
  auto y = StreamReader::open(begin + num_bytes[0], num_bytes[1], codes[1]);
  auto z = StreamReader::open(begin + num_bytes[0] + num_bytes[1], num_bytes[2], codes[2]);
  if (!x || !y || !z) refuse("its codes are damaged");
  // Three streams side by side, because each waits for its last number before the next.
  TileOffset p;
  for (TileOffset& point : points) {
    p.x = static_cast<std::uint16_t>(p.x + unfold(x->next()));
    p.y = static_cast<std::uint16_t>(p.y + unfold(y->next()));
    p.z = static_cast<std::uint16_t>(p.z + unfold(z->next()));
    point = p;
  }
  if (!x->is_at_end() || !y->is_at_end() || !z->is_at_end()) refuse("its streams are damaged");
}

void put_stored(ByteWriter& writer, std::span<const TileOffset> points) {
  for (const TileOffset& p : points) {
    writer.put(p.x);
    writer.put(p.y);
    writer.put(p.z);
  }
}

void decode_stored(ByteReader& reader, std::span<TileOffset> points) {
  if (reader.remaining() != points.size() * kBytesPerPoint) {
    refuse("its size does not fit its points");
  }
  for (TileOffset& p : points) {
    p.x = reader.get<std::uint16_t>();
    p.y = reader.get<std::uint16_t>();
    p.z = reader.get<std::uint16_t>();
  }
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
  const Bytes payload = coded(points);
  const bool is_coded = payload.size() < points.size() * kBytesPerPoint;
  ByteWriter writer;
  writer.put(kFormat);
  writer.put(is_coded ? kCoded : kStored);
  writer.put(static_cast<std::uint16_t>(points.size() - 1));
  if (is_coded) {
    writer.put_bytes(payload);
  } else {
    put_stored(writer, points);
  }
  return writer.take();
}

std::vector<TileOffset> decode_block(std::span<const std::byte> bytes) {
  ByteReader reader(bytes, "point block");
  if (reader.get<std::uint8_t>() != kFormat) refuse("unknown format");
  const auto packing = reader.get<std::uint8_t>();
  const std::size_t num_points = std::size_t{reader.get<std::uint16_t>()} + 1;
  if (packing > kCoded) refuse("unknown packing");
  std::vector<TileOffset> points(num_points);
  if (packing == kCoded) {
    decode_coded(reader, points);
  } else {
    decode_stored(reader, points);
  }
  check_order(points);
  return points;
}

}  // namespace gdfmap
