#include "alignment_gates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <gdfmap/core/run_context.hpp>

namespace gdfmap {
namespace {

/// Registered patches are as many as that at most, spread over the cloud.
constexpr std::size_t kMaxPatches = 64;
/// Least noise that a surface is said to have, of a voxel: exact data would allow no error.
constexpr double kLeastNoise = 0.01;

std::string centimetres(double metres) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.1f cm", 100.0 * metres);
  return text.data();
}

std::string degrees(double angle_deg) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.2f degrees", angle_deg);
  return text.data();
}

/// How far the points of a surface lie off the surface of their nearest neighbours: what the rmse
/// of a registration comes to when nothing is wrong with the pose.
double noise_of(const SurfaceCloud& surface, double voxel) {
  double squares = 0.0;
  std::size_t count = 0;
  std::vector<std::uint32_t> neighbors;
  for (std::size_t i = 0; i < surface.size(); ++i) {
    surface.tree().nearest(surface.points()[i], 2, neighbors);
    for (const std::uint32_t other : neighbors) {
      if (other == i) continue;
      const Vector3 difference = surface.points()[i] - surface.points()[other];
      if (difference.norm() > OnSurface::kReach * voxel) continue;
      const auto distance =
          OnSurface::distance(difference, surface.normals()[i], surface.normals()[other], voxel);
      if (!distance) continue;
      squares += *distance * *distance;
      ++count;
    }
  }
  return count == 0 ? 0.0 : std::sqrt(squares / static_cast<double>(count));
}

Vector3 mean_of(std::span<const Vector3> points) {
  Vector3 sum = Vector3::Zero();
  for (const Vector3& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

/// How far a motion of a registered scan shifts its surfaces, as the root mean square along their
/// normals: what the scan does not determine does not count.
double surface_shift(const RegistrationResult& scan, const Eigen::Isometry3d& motion) {
  const Eigen::AngleAxisd rotation(motion.linear());
  Twist twist;
  twist << motion * scan.center - scan.center, rotation.angle() * rotation.axis();
  const double squares = twist.dot(scan.information * twist) * scan.rmse * scan.rmse;
  return std::sqrt(squares / static_cast<double>(scan.num_inliers));
}

/// The alignment as one gate after the other sees it.
class Judge {
 public:
  Judge(const AlignmentCase& alignment, const AlignmentOptions& options, AlignmentReport& report)
      : case_(alignment),
        options_(options),
        report_(report),
        voxel_(alignment.registration.voxel),
        num_threads_(RunContext{alignment.registration.num_threads}.threads()),
        T_(report.registration.T_target_source),
        placed_(place(alignment.p_nominal)) {}

  /// Empty when every gate is passed.
  [[nodiscard]] std::string verdict() {
    if (!is_usable(report_.registration.status)) return report_.registration.reason;
    if (auto reason = check_noise(); !reason.empty()) return reason;
    if (auto reason = check_backward(); !reason.empty()) return reason;
    return check_patches();
  }

 private:
  [[nodiscard]] std::vector<Vector3> place(std::span<const Vector3> p_nominal) const {
    std::vector<Vector3> placed;
    placed.reserve(p_nominal.size());
    for (const Vector3& p : p_nominal) placed.push_back(T_ * p);
    return placed;
  }

  [[nodiscard]] std::string check_noise() {
    const Scan scan(placed_);
    report_.noise =
        std::max({noise_of(case_.map.surface(voxel_, num_threads_), voxel_),
                  noise_of(scan.surface(voxel_, num_threads_), voxel_), kLeastNoise * voxel_});
    const double limit = options_.max_rmse_over_noise * report_.noise;
    if (report_.registration.rmse <= limit) return {};
    return "the scan lies " + centimetres(report_.registration.rmse) +
           " off the map's surface, for the noise of both " + centimetres(limit) + " is the limit";
  }

  /// Points of the map, in its frame, near the placed scan.
  [[nodiscard]] std::vector<Vector3> map_points_near(const MapWindow& scan) const {
    const SurfaceCloud& map_surface = case_.map.surface(voxel_, num_threads_);
    const SurfaceCloud& scan_surface = scan.surface(voxel_, num_threads_);
    const Vector3 to_scan = case_.map.origin_world() - scan.origin_world();
    std::vector<Vector3> near;
    for (const Vector3& p : map_surface.points()) {
      if (!scan_surface.tree().nearest(p + to_scan, OnSurface::kReach * voxel_)) continue;
      near.push_back(p + case_.map.origin_world());
    }
    return near;
  }

  [[nodiscard]] std::string check_backward() {
    const MapWindow scan(placed_);
    const RegistrationResult backward = case_.backward_method.provide(
        scan, Scan(map_points_near(scan)), Eigen::Isometry3d::Identity(), case_.registration);
    if (!is_usable(backward.status)) return "the map does not fit the scan: " + backward.reason;
    const Eigen::Isometry3d& T = backward.T_target_source;
    const Vector3 center = mean_of(placed_);
    report_.backward_translation = (T * center - center).norm();
    report_.backward_rotation_deg =
        Eigen::AngleAxisd(T.linear()).angle() * 180.0 / std::numbers::pi;
    if (report_.backward_translation <= options_.max_backward_translation &&
        report_.backward_rotation_deg <= options_.max_backward_rotation_deg) {
      return {};
    }
    return "registering the map onto the scan gives another pose, " +
           centimetres(report_.backward_translation) + " and " +
           degrees(report_.backward_rotation_deg) + " off; the limits are " +
           centimetres(options_.max_backward_translation) + " and " +
           degrees(options_.max_backward_rotation_deg);
  }

  /// Points of the scan, in the nominal frame, by the square of the ground that they lie in.
  [[nodiscard]] std::vector<std::vector<Vector3>> patches() const {
    std::map<std::pair<std::int64_t, std::int64_t>, std::vector<Vector3>> squares;
    for (std::size_t i = 0; i < placed_.size(); ++i) {
      const Vector3 square = placed_[i] / options_.patch_size;
      squares[{floor_to_integer(square.x()), floor_to_integer(square.y())}].push_back(
          case_.p_nominal[i]);
    }
    std::erase_if(squares, [&](const auto& entry) {
      return entry.second.size() < case_.registration.min_points;
    });
    std::vector<std::vector<Vector3>> result;
    const std::size_t stride = squares.size() / kMaxPatches + 1;
    std::size_t i = 0;
    for (auto& [key, points] : squares) {
      if (i++ % stride == 0) result.push_back(std::move(points));
    }
    return result;
  }

  [[nodiscard]] std::string check_patches() {
    const std::vector<std::vector<Vector3>> all = patches();
    if (all.size() < 2) return {};
    for (const std::vector<Vector3>& patch : all) {
      const RegistrationResult own =
          case_.method.provide(case_.map, Scan(patch), T_, case_.registration);
      // A patch that lies beside the map, or on a plane, says nothing of the others.
      if (own.status != RegistrationStatus::kConverged) continue;
      report_.patch_shifts.push_back(surface_shift(own, T_ * own.T_target_source.inverse()));
    }
    std::vector<double>& shifts = report_.patch_shifts;
    std::ranges::sort(shifts);
    const double limit = options_.max_patch_shift_over_noise * report_.noise;
    const auto num_agreeing = std::ranges::upper_bound(shifts, limit) - shifts.begin();
    if (static_cast<double>(num_agreeing) >=
        options_.min_patch_agreement * static_cast<double>(shifts.size())) {
      return {};
    }
    return "of " + std::to_string(shifts.size()) + " patches only " + std::to_string(num_agreeing) +
           " agree with the pose of the whole: the cloud is bent, or the pose is wrong";
  }

  const AlignmentCase& case_;
  const AlignmentOptions& options_;
  AlignmentReport& report_;
  double voxel_;
  int num_threads_;
  Eigen::Isometry3d T_;
  std::vector<Vector3> placed_;  ///< p_nominal where the registration puts them
};

}  // namespace

void judge_alignment(const AlignmentCase& alignment, const AlignmentOptions& options,
                     AlignmentReport& report) {
  report.reason = Judge(alignment, options, report).verdict();
  report.accepted = report.reason.empty();
}

}  // namespace gdfmap
