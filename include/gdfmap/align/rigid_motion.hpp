#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap {

/// A small rigid motion (v, ω): metres, then radians, both in the axes of the target. It stands to
/// the left of a pose: T becomes exp_twist(ξ) · T.
using Twist = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// The matrix of a ↦ w × a.
[[nodiscard]] Eigen::Matrix3d skew(const Vector3& w);

/// Rodrigues' formula.
[[nodiscard]] Eigen::Matrix3d exp_rotation(const Vector3& w);

/// exp of se(3): rotation exp([ω]×), translation V(ω)·v with
/// V(ω) = I + (1 − cos θ)/θ² W + (θ − sin θ)/θ³ W², W = [ω]×, θ = |ω|.
[[nodiscard]] Eigen::Isometry3d exp_twist(const Twist& twist);

/// The inverse of exp_twist for rotations by less than half a turn.
[[nodiscard]] Twist log_motion(const Eigen::Isometry3d& T);

/// Angle of the rotation in radians, 0 to π; accurate for the smallest angles too.
[[nodiscard]] double rotation_angle(const Eigen::Isometry3d& T);

/// Translation in metres, then roll about x, pitch about y, yaw about z in radians:
/// R = Rz(yaw) · Ry(pitch) · Rx(roll).
[[nodiscard]] Eigen::Isometry3d motion_from_angles(const Vector3& translation,
                                                   const Vector3& roll_pitch_yaw);

/// The same motion between frames whose origins are moved: target coordinates are given less
/// target_origin, source coordinates less source_origin.
[[nodiscard]] Eigen::Isometry3d between_origins(const Eigen::Isometry3d& T_target_source,
                                                const Vector3& target_origin,
                                                const Vector3& source_origin);

}  // namespace gdfmap
