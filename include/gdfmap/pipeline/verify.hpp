#pragma once

#include <optional>
#include <string>
#include <vector>

#include <gdfmap/core/run_context.hpp>
#include <gdfmap/map/map.hpp>

namespace gdfmap {

struct VerifyReport {
  std::vector<std::string> cube_faults;   ///< in cubes.db, one line each
  std::vector<std::string> point_faults;  ///< in points.db, one line each
  std::optional<Digest> content_digest;   ///< empty when the damage does not let it be computed

  [[nodiscard]] bool sound() const { return cube_faults.empty() && point_faults.empty(); }
};

/// SQLite's integrity check, the counts and the cross-references of both databases; without `quick`
/// also every checksum of block and tile. That the two belong together is checked when a map is
/// opened. Changes nothing and may run beside a writer; a writer cannot begin meanwhile.
/// @throws Error kInterrupted when stopped
[[nodiscard]] VerifyReport verify(Map& map, bool quick, const RunContext& context = {});

}  // namespace gdfmap
