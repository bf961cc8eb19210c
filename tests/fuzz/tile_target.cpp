#include <algorithm>

#include <gdfmap/store/surroundings.hpp>
#include <gdfmap/store/tile_codec.hpp>

#include "harness.hpp"

namespace gdfmap::fuzz {

bool fuzz_tile(Input bytes) {
  return accepts({ErrorCode::kCorrupt}, [&] {
    const TileRecord tile = decode_tile(bytes);
    require(std::ranges::equal(encode_tile(tile), bytes), "a tile has one form");
    static_cast<void>(content_digest(tile));
  });
}

bool fuzz_surroundings(Input bytes) {
  constexpr TileKey kTile{1, 10, -20, 30};
  return accepts({ErrorCode::kCorrupt}, [&] {
    const std::vector<SurroundingTile> tiles = decode_surroundings(kTile, bytes);
    require(std::ranges::equal(encode_surroundings(kTile, tiles), bytes), "a list has one form");
  });
}

}  // namespace gdfmap::fuzz
