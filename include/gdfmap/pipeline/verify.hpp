#pragma once

#include <string>
#include <vector>

#include <gdfmap/map/map.hpp>

namespace gdfmap {

struct VerifyReport {
  std::vector<std::string> faults;  ///< one line each; empty: sound
  Digest content_digest;
};

/// SQLite's integrity check and the counts of both databases, and that they are of one map; without
/// `quick` also every checksum of block and tile.
[[nodiscard]] VerifyReport verify(Map& map, bool quick);

}  // namespace gdfmap
