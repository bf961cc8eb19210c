#include <gdfmap/io/poses.hpp>

#include "harness.hpp"

namespace gdfmap::fuzz {
namespace {

/// Eight numbers and the spaces between them.
constexpr std::size_t kFewestBytesPerPose = 15;

}  // namespace

bool fuzz_poses(Input bytes) {
  static MemoryFile file(".txt");
  const std::filesystem::path& path = file.hold(bytes);
  // kCorrupt is a line too long to be one.
  return accepts({ErrorCode::kUsage, ErrorCode::kCorrupt}, [&] {
    const std::vector<Eigen::Isometry3d> poses = read_poses(path);
    require(!poses.empty(), "a file without poses is refused");
    require(poses.size() * kFewestBytesPerPose <= bytes.size(), "poses need bytes");
    for (const Eigen::Isometry3d& pose : poses) {
      const Eigen::Matrix3d R = pose.linear();
      require(pose.matrix().allFinite(), "a pose is finite");
      require(
          (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-9 && R.determinant() > 0.0,
          "a pose is a rotation and a translation");
    }
  });
}

}  // namespace gdfmap::fuzz
