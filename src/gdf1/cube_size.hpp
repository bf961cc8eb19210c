#pragma once

#include <array>
#include <optional>
#include <vector>

namespace gdfmap::gdf1 {

/// The decimal that a float32 stands for: 0.1 for 0.1f, which is 0.10000000149 in double. Cube
/// sizes are written by people; keys far from the origin need all digits.
[[nodiscard]] double decimal_of(float value);

/// The greatest common step of cube origins, axis by axis (metres, float32 or six decimals); empty
/// when there is none, as where the only cube stands at the origin.
[[nodiscard]] std::optional<double> deduce_cube_size(
    const std::array<std::vector<float>, 3>& origins);

}  // namespace gdfmap::gdf1
