#include <algorithm>

#include <gdfmap/store/tile_codec.hpp>

#include "harness.hpp"

namespace gdfmap::fuzz {

bool fuzz_tile(Input bytes) {
  return accepts({ErrorCode::kCorrupt}, [&] {
    TileRecord tile;
    tile.cubes = decode_tile(bytes);
    require(std::ranges::equal(encode_tile(tile), bytes), "a tile has one form");
    static_cast<void>(content_digest(tile));
  });
}

}  // namespace gdfmap::fuzz
