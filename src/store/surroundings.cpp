#include <limits>

#include <gdfmap/core/error.hpp>
#include <gdfmap/store/surroundings.hpp>

namespace gdfmap {
namespace {

constexpr std::size_t kEntryBytes = 3 + 16;
using Limits = std::numeric_limits<std::int8_t>;

std::int8_t offset(std::int64_t from, std::int64_t to) {
  if (to - from < Limits::min() || to - from > Limits::max()) {
    throw Error(ErrorCode::kInternal, "a tile was made from points too far away");
  }
  return static_cast<std::int8_t>(to - from);
}

/// The rule that writer and reader share.
void check_order(std::span<const SurroundingTile> surroundings, ErrorCode code) {
  for (std::size_t i = 0; i < surroundings.size(); ++i) {
    if (surroundings[i].digest == Digest{} ||
        (i > 0 && !(surroundings[i - 1].key < surroundings[i].key))) {
      throw Error(code, "the tiles that it was made from are out of order");
    }
  }
}

}  // namespace

Bytes encode_surroundings(const TileKey& tile, std::span<const SurroundingTile> surroundings) {
  check_order(surroundings, ErrorCode::kInternal);
  ByteWriter writer;
  for (const SurroundingTile& other : surroundings) {
    writer.put(offset(tile.x, other.key.x));
    writer.put(offset(tile.y, other.key.y));
    writer.put(offset(tile.z, other.key.z));
    writer.put(other.digest);
  }
  return writer.take();
}

std::vector<SurroundingTile> decode_surroundings(const TileKey& tile,
                                                 std::span<const std::byte> bytes) {
  ByteReader reader(bytes, "the tiles that it was made from");
  std::vector<SurroundingTile> surroundings;
  surroundings.reserve(bytes.size() / kEntryBytes);
  while (reader.remaining() > 0) {
    SurroundingTile& other = surroundings.emplace_back();
    other.key.level = tile.level;
    other.key.x = tile.x + reader.get<std::int8_t>();
    other.key.y = tile.y + reader.get<std::int8_t>();
    other.key.z = tile.z + reader.get<std::int8_t>();
    other.digest = reader.get_digest();
  }
  check_order(surroundings, ErrorCode::kCorrupt);
  return surroundings;
}

Digest surroundings_digest(const TileKey& tile, std::span<const SurroundingTile> surroundings) {
  return hash128(encode_surroundings(tile, surroundings));
}

}  // namespace gdfmap
