#pragma once

#include <span>
#include <string>

#include <gdfmap/query/path_queries.hpp>

namespace gdfmap::cli {

/// One row, or one JSON object: length, distance, x, y, z, place_at, status, lower_bound,
/// free_length, is_free, unknown_length.
[[nodiscard]] std::string clearance_text(const PathClearance& clearance, bool json);

/// One row, or one object of a JSON array, a ray: x, y, z, dx, dy, dz as given, then end, range,
/// free_range, hit_x, hit_y, hit_z, distance, status.
[[nodiscard]] std::string rays_text(std::span<const Ray> rays, std::span<const RayHit> hits,
                                    bool json);

}  // namespace gdfmap::cli
