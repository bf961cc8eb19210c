#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <gdfmap/align/registration.hpp>
#include <gdfmap/core/error.hpp>

#include "align_fixtures.hpp"
#include "support/lidar_room.hpp"

namespace gdfmap {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
const Eigen::Isometry3d kIdentity = Eigen::Isometry3d::Identity();

double metres_off(const RegistrationResult& result, const Eigen::Isometry3d& T_true) {
  return (T_true.inverse() * result.T_target_source).translation().norm();
}
double degrees_off(const RegistrationResult& result, const Eigen::Isometry3d& T_true) {
  return rotation_angle(T_true.inverse() * result.T_target_source) / kDegree;
}

RegistrationResult register_clouds(const char* method, const std::vector<Vector3>& target,
                                   const std::vector<Vector3>& source,
                                   const Eigen::Isometry3d& T_init = kIdentity) {
  const RegistrationOptions options;
  return make_registration_method(method)->provide(MapWindow(target), Scan(source), T_init,
                                                   options);
}

class Methods : public testing::TestWithParam<const char*> {};

TEST_P(Methods, FindTheExactPosesOfASyntheticLidar) {
  for (std::uint32_t i = 0; i < 3; ++i) {
    const test::LidarPair pair = test::lidar_pair(i);
    const RegistrationResult result = register_clouds(GetParam(), pair.target, pair.source);
    const bool is_point = std::string_view(GetParam()) == "icp-point";
    EXPECT_EQ(result.status, RegistrationStatus::kConverged) << result.reason;
    EXPECT_LT(metres_off(result, pair.T_target_source), is_point ? 0.08 : 0.003);
    EXPECT_LT(degrees_off(result, pair.T_target_source), is_point ? 0.5 : 0.02);
    EXPECT_GT(result.inlier_ratio, 0.85);
    EXPECT_TRUE(result.unobservable.empty());
  }
}

TEST_P(Methods, SoakMeanErrorsOfTwentyLidarPairsMeetTheirBounds) {
  constexpr std::uint32_t kPairs = 20;
  double metres = 0.0, degrees = 0.0;
  for (std::uint32_t i = 0; i < kPairs; ++i) {
    const test::LidarPair pair = test::lidar_pair(i);
    const RegistrationResult result = register_clouds(GetParam(), pair.target, pair.source);
    EXPECT_EQ(result.status, RegistrationStatus::kConverged) << i << ": " << result.reason;
    metres += metres_off(result, pair.T_target_source) / kPairs;
    degrees += degrees_off(result, pair.T_target_source) / kPairs;
  }
  const bool is_point = std::string_view(GetParam()) == "icp-point";
  EXPECT_LT(metres, is_point ? 0.02 : 0.002);
  EXPECT_LT(degrees, is_point ? 0.2 : 0.02);
}

TEST_P(Methods, AreTheSameForAnyNumberOfThreadsAndOrderOfTheTarget) {
  test::LidarOptions small;
  small.num_columns = 256;
  test::LidarPair pair = test::lidar_pair(1, small);
  const auto method = make_registration_method(GetParam());
  RegistrationOptions one, four;
  one.num_threads = 1;
  four.num_threads = 4;
  const RegistrationResult a =
      method->provide(MapWindow(pair.target), Scan(pair.source), kIdentity, one);
  std::reverse(pair.target.begin(), pair.target.end());
  const RegistrationResult b =
      method->provide(MapWindow(pair.target), Scan(pair.source), kIdentity, four);
  EXPECT_EQ(a.T_target_source.matrix(), b.T_target_source.matrix());
  EXPECT_EQ(a.information, b.information);
  EXPECT_EQ(a.iterations, b.iterations);
}

TEST_P(Methods, WorkFarFromTheOriginOfTheWorld) {
  test::LidarOptions small;
  small.num_columns = 512;
  test::LidarPair pair = test::lidar_pair(2, small);
  const Eigen::Isometry3d T_utm(Eigen::Translation3d(512'345.0, 4'543'210.0, 300.0));
  const Eigen::Isometry3d T_true = T_utm * pair.T_target_source;
  const RegistrationResult result =
      register_clouds(GetParam(), test::moved(T_utm, pair.target), pair.source, T_utm);
  EXPECT_EQ(result.status, RegistrationStatus::kConverged) << result.reason;
  EXPECT_LT(metres_off(result, T_true), 0.08);
  EXPECT_LT((result.center - T_true.translation()).norm(), 30.0);
}

TEST_P(Methods, RefuseAPoseWithoutOverlap) {
  test::LidarOptions small;
  small.num_columns = 256;
  const test::LidarPair pair = test::lidar_pair(3, small);
  const Eigen::Isometry3d away(Eigen::Translation3d(500.0, 0.0, 0.0));
  const RegistrationResult result = register_clouds(GetParam(), pair.target, pair.source, away);
  EXPECT_EQ(result.status, RegistrationStatus::kRejected);
  EXPECT_FALSE(is_usable(result.status));
  EXPECT_FALSE(result.reason.empty());
}

TEST_P(Methods, CallABarePlaneDegenerate) {
  std::vector<Vector3> target, source;
  for (const Vector3& p : test::corner_points(60'000, 20.0, 0.01, 1)) {
    if (p.z() < 0.06) target.push_back(p);
  }
  for (const Vector3& p : test::corner_points(60'000, 20.0, 0.01, 2)) {
    if (p.z() < 0.06) source.push_back(p);
  }
  const RegistrationResult result = register_clouds(GetParam(), target, source);
  EXPECT_EQ(result.status, RegistrationStatus::kDegenerate) << result.reason;
  ASSERT_EQ(result.unobservable.size(), 3u);
  for (const Twist& axis : result.unobservable) {
    EXPECT_NEAR(axis[2], 0.0, 0.02);  // neither along z
    EXPECT_NEAR(axis[3], 0.0, 0.02);  // nor a tilt
    EXPECT_NEAR(axis[4], 0.0, 0.02);
  }
}

/// Floor, ceiling and both walls of a corridor along x.
std::vector<Vector3> corridor_points(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.01);
  std::vector<Vector3> points;
  for (int i = 0; i < 60'000; ++i) {
    Vector3 p(40.0 * unit(random) - 20.0, 3.0 * unit(random), 2.5 * unit(random));
    if (i % 2 == 0) {
      p.y() = (i % 4 == 0 ? 0.0 : 3.0) + noise(random);
    } else {
      p.z() = (i % 4 == 1 ? 0.0 : 2.5) + noise(random);
    }
    points.push_back(p);
  }
  return points;
}

TEST_P(Methods, CallACorridorDegenerateAlongItself) {
  const RegistrationResult result =
      register_clouds(GetParam(), corridor_points(1), corridor_points(2));
  EXPECT_EQ(result.status, RegistrationStatus::kDegenerate) << result.reason;
  ASSERT_EQ(result.unobservable.size(), 1u);
  EXPECT_GT(std::abs(result.unobservable[0][0]), 0.99);
  // What is not observed has no variance, rather than an arbitrary one.
  EXPECT_LT(result.covariance(0, 0), 1e-3 * result.covariance(1, 1) + 1e-12);
}

TEST_P(Methods, NeedPoints) {
  const std::vector<Vector3> many = test::corner_points(5000, 5.0, 0.0, 1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Vector3> none, few(many.begin(), many.begin() + 20),
      broken(1000, Vector3(nan, 0.0, 0.0));
  for (const auto& cloud : {none, few, broken}) {
    EXPECT_EQ(register_clouds(GetParam(), many, cloud).status, RegistrationStatus::kTooFew);
    EXPECT_EQ(register_clouds(GetParam(), cloud, many).status, RegistrationStatus::kTooFew);
  }
}

TEST_P(Methods, PassOverPointsThatAreNotFinite) {
  test::LidarOptions small;
  small.num_columns = 256;
  test::LidarPair pair = test::lidar_pair(4, small);
  const RegistrationResult clean = register_clouds(GetParam(), pair.target, pair.source);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  pair.target.insert(pair.target.begin() + 7, Vector3(nan, 1.0, 1.0));
  pair.source.insert(pair.source.begin() + 9, Vector3(1.0, nan, 1.0));
  const RegistrationResult result = register_clouds(GetParam(), pair.target, pair.source);
  EXPECT_EQ(result.T_target_source.matrix(), clean.T_target_source.matrix());
}

INSTANTIATE_TEST_SUITE_P(All, Methods,
                         testing::Values("icp-point", "icp-plane", "gicp", "gradicp", "ndt",
                                         "auto"),
                         [](const auto& method) {
                           std::string name = method.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(Registration, TruthIsJudgedLikeAnyOtherPose) {
  test::LidarOptions small;
  small.num_columns = 512;
  const test::LidarPair pair = test::lidar_pair(5, small);
  const MapWindow target(pair.target);
  const Scan source(pair.source);
  const Eigen::Isometry3d T_world_target = test::lidar_pair(6, small).T_target_source;
  const RegistrationResult right = make_truth(T_world_target, T_world_target * pair.T_target_source)
                                       ->provide(target, source, kIdentity, {});
  EXPECT_LT(metres_off(right, pair.T_target_source), 1e-12);
  EXPECT_EQ(right.status, RegistrationStatus::kConverged) << right.reason;
  const Eigen::Isometry3d wrong(Eigen::Translation3d(3.0, 2.0, 0.0));
  const RegistrationResult refused =
      make_truth(T_world_target, T_world_target * wrong)->provide(target, source, kIdentity, {});
  EXPECT_EQ(refused.status, RegistrationStatus::kRejected);
}

TEST(Registration, CovarianceTellsHowFarPosesScatter) {
  // The noise of a scan, thinned to voxels: the spread of repeated registrations is what the
  // covariance says, within a factor that correlated normals and voxels leave.
  test::LidarOptions small;
  small.num_columns = 256;
  const MapWindow target(test::lidar_scan_of_room(kIdentity * Eigen::Translation3d(0, 0, 1.5), 99));
  Twist sum_squares = Twist::Zero(), variance = Twist::Zero();
  constexpr int kRuns = 10;
  for (std::uint32_t i = 0; i < kRuns; ++i) {
    const Scan scan(
        test::lidar_scan_of_room(kIdentity * Eigen::Translation3d(0, 0, 1.5), i, small));
    const RegistrationResult result =
        make_registration_method("icp-plane")->provide(target, scan, kIdentity, {});
    ASSERT_EQ(result.status, RegistrationStatus::kConverged);
    sum_squares += log_motion(result.T_target_source).cwiseAbs2();
    variance = result.covariance.diagonal();
  }
  const double ratio = (sum_squares.head<3>() / kRuns).sum() / variance.head<3>().sum();
  EXPECT_GT(ratio, 0.02);
  EXPECT_LT(ratio, 50.0);
}

TEST(Registration, RefusesWhatItCannotUse) {
  EXPECT_THROW(make_registration_method("icp"), Error);
  const std::vector<Vector3> cloud = test::corner_points(2000, 5.0, 0.0, 1);
  const MapWindow target(cloud);
  const Scan source(cloud);
  const auto method = make_registration_method("icp-plane");
  RegistrationOptions options;
  options.voxel = 0.0;
  EXPECT_THROW(method->provide(target, source, kIdentity, options), Error);
  Eigen::Isometry3d stretched = kIdentity;
  stretched.linear() *= 2.0;
  EXPECT_THROW(method->provide(target, source, stretched, {}), Error);
  Eigen::Isometry3d unknown = kIdentity;
  unknown.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(method->provide(target, source, unknown, {}), Error);
}

TEST(Registration, WrongByFiftyMetresIsNeverConfident) {
  const test::LidarPair pair = test::lidar_pair(0);
  const MapWindow target(pair.target);
  const Scan source(pair.source);
  for (const char* const name : registration_method_names()) {
    if (std::string_view(name) == "field") continue;  // a cloud has none
    for (int direction = 0; direction < 4; ++direction) {
      const double angle = 90.0 * kDegree * direction;
      const Eigen::Isometry3d wrong(
          Eigen::Translation3d(50.0 * std::cos(angle), 50.0 * std::sin(angle), 0.0));
      const RegistrationResult result =
          make_registration_method(name)->provide(target, source, wrong * pair.T_target_source, {});
      EXPECT_FALSE(is_usable(result.status)) << name << " " << direction;
    }
  }
}

}  // namespace
}  // namespace gdfmap
