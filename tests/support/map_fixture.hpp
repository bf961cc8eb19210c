#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/fit/fit_config.hpp>
#include <gdfmap/map/map.hpp>

namespace gdfmap::test {

/// Writes points to a PLY file of doubles.
void write_cloud(const std::filesystem::path& path, std::span<const Vector3> points);

/// All points of a file in any format.
[[nodiscard]] std::vector<Vector3> read_cloud(const std::filesystem::path& path);

/// The first `count` points of an analytic scene, without noise.
[[nodiscard]] std::vector<Vector3> scene_points(const std::string& scene, std::uint64_t count,
                                                double size = 0.0);

/// Few and quick cubes: for tests of what is trained, not of how well.
[[nodiscard]] FitConfig quick_fit_config(int max_iterations = 3);

/// A new map at `path` that holds these points, not trained.
[[nodiscard]] Map map_of(const std::filesystem::path& path, std::span<const Vector3> points,
                         double cube_size = 1.0, int num_levels = 1);

/// All bytes of a file.
[[nodiscard]] std::string read_file(const std::filesystem::path& path);

}  // namespace gdfmap::test
