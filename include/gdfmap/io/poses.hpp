#pragma once

#include <filesystem>
#include <vector>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap {

/// Reads the poses of a sensor, T_world_sensor, metres, one a line, in the order of the file ("-":
/// standard input). Every line has the same form, which its number of columns tells:
///   12: the upper three rows of a matrix, row by row (KITTI odometry);
///    8: time, x, y, z, and a quaternion x, y, z, w (TUM); the time is not used.
/// Columns are separated by white space. Blank lines and lines that begin with # are passed over.
/// @throws Error kIo when it cannot be read; kUsage naming the line when it has another number of
///         columns, something that is no finite number, or no rotation; kUsage for a file without
///         poses; kCorrupt for a line longer than 256 KiB.
[[nodiscard]] std::vector<Eigen::Isometry3d> read_poses(const std::filesystem::path& path);

}  // namespace gdfmap
