#include <algorithm>

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

}  // namespace gdfmap::fuzz
