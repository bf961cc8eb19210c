#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace gdfmap::fuzz {

/// What every target does with any bytes: reads them as one format. It returns whether they were
/// accepted, and ends the process (as libFuzzer expects it) when anything but a value or the
/// documented gdfmap::Error comes of it, or when what was accepted breaks a promise of the reader.
using Input = std::span<const std::byte>;

[[nodiscard]] bool fuzz_ply(Input bytes);
[[nodiscard]] bool fuzz_pcd(Input bytes);
[[nodiscard]] bool fuzz_las(Input bytes);
[[nodiscard]] bool fuzz_xyz(Input bytes);  ///< through the recognition of formats
[[nodiscard]] bool fuzz_poses(Input bytes);
[[nodiscard]] bool fuzz_block(Input bytes);         ///< blocks of points.db
[[nodiscard]] bool fuzz_tile(Input bytes);          ///< tiles of cubes.db
[[nodiscard]] bool fuzz_surroundings(Input bytes);  ///< what such a tile was trained from
[[nodiscard]] bool fuzz_gdf1(Input bytes);
[[nodiscard]] bool fuzz_csv(Input bytes);
[[nodiscard]] bool fuzz_yaml(Input bytes);

struct Target {
  const char* name;  ///< also of its directory in tests/fuzz/corpus
  bool (*run)(Input bytes);
};
inline constexpr std::array kTargets = {
    Target{"ply", fuzz_ply},     Target{"pcd", fuzz_pcd},
    Target{"las", fuzz_las},     Target{"xyz", fuzz_xyz},
    Target{"poses", fuzz_poses}, Target{"block", fuzz_block},
    Target{"tile", fuzz_tile},   Target{"surroundings", fuzz_surroundings},
    Target{"gdf1", fuzz_gdf1},   Target{"csv", fuzz_csv},
    Target{"yaml", fuzz_yaml}};

}  // namespace gdfmap::fuzz
