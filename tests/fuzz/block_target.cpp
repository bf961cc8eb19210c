#include <vector>

#include <gdfmap/tiling/block_codec.hpp>

#include "harness.hpp"

namespace gdfmap::fuzz {

bool fuzz_block(Input bytes) {
  return accepts({ErrorCode::kCorrupt}, [&] {
    const std::vector<TileOffset> points = decode_block(bytes);
    require(points.size() <= kMaxBlockPoints, "a block is bounded");
    require(decode_block(encode_block(points)) == points, "a block can be written again");
  });
}

}  // namespace gdfmap::fuzz
