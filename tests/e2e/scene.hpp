#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap::test {

/// Points on a square of the plane z = height around (x, y), edge metres wide, the same for the
/// same arguments: enough for a map of a few dozen cubes.
[[nodiscard]] std::vector<Vector3> square(double x, double y, double height, double edge,
                                          std::size_t count);

/// The same points in another order.
[[nodiscard]] std::vector<Vector3> shuffled(std::vector<Vector3> points);

/// Writes text, or points as x, y, z lines that read back exactly.
void write_text(const std::filesystem::path& path, const std::string& text);
void write_xyz(const std::filesystem::path& path, std::span<const Vector3> points);

/// Two overlapping scans around the world's origin, where eight tiles meet.
[[nodiscard]] std::vector<Vector3> first_scan();
[[nodiscard]] std::vector<Vector3> second_scan();

}  // namespace gdfmap::test
