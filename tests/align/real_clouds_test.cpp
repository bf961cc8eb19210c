// Real clouds: two automotive scans, and 14 scans of a nearly still robot.

#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/align/registration.hpp>

#include "align_fixtures.hpp"
#include "support/map_fixture.hpp"

namespace gdfmap {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
const std::filesystem::path kShared = GDFMAP_SHARED_DATA;

/// Rows of a rigid motion, its rotation made exact again.
Eigen::Isometry3d read_rows(std::istream& stream) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 12; ++i) stream >> T.matrix()(i / 4, i % 4);
  T.linear() = Eigen::Quaterniond(T.rotation()).normalized().toRotationMatrix();
  return T;
}

double metres_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.inverse() * b).translation().norm();
}
double degrees_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return rotation_angle(a.inverse() * b) / kDegree;
}

class AutomotivePair : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path directory = kShared / "small_gicp_pair";
    if (!std::filesystem::exists(directory)) GTEST_SKIP() << "no clouds at " << directory;
    std::ifstream file(directory / "T_target_source.txt");
    T_ = read_rows(file);
    target_.emplace(test::read_cloud(directory / "target.ply"));
    source_.emplace(test::read_cloud(directory / "source.ply"));
  }

  /// Share of random first guesses at this distance from which a method ends within 0.2 m and 1
  /// degree; no other result may be trusted.
  double basin(const char* method, double metres, double degrees, int num_starts) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    const auto direction = [&] {
      Vector3 v;
      for (double& c : v) c = normal(random);
      return Vector3(v.normalized());
    };
    int num_found = 0;
    for (int i = 0; i < num_starts; ++i) {
      Eigen::Isometry3d away = Eigen::Isometry3d::Identity();
      away.translation() = metres * direction();
      away.linear() = exp_rotation(degrees * kDegree * direction());
      const RegistrationResult result =
          make_registration_method(method)->provide(*target_, *source_, away * T_, {});
      const bool is_found = metres_between(T_, result.T_target_source) < 0.2 &&
                            degrees_between(T_, result.T_target_source) < 1.0;
      EXPECT_TRUE(is_found || !is_usable(result.status)) << "start " << i;
      if (is_found) ++num_found;
    }
    return static_cast<double>(num_found) / num_starts;
  }

  Eigen::Isometry3d T_;
  std::optional<MapWindow> target_;
  std::optional<Scan> source_;
};

TEST_F(AutomotivePair, EveryMethodFindsThePoseFromTheIdentity) {
  for (const char* const method : {"icp-point", "icp-plane", "gicp", "gradicp", "ndt", "auto"}) {
    const RegistrationResult result = make_registration_method(method)->provide(
        *target_, *source_, Eigen::Isometry3d::Identity(), {});
    EXPECT_EQ(result.status, RegistrationStatus::kConverged) << method << ": " << result.reason;
    EXPECT_LT(metres_between(T_, result.T_target_source), 0.02) << method;
    EXPECT_LT(degrees_between(T_, result.T_target_source), 0.4) << method;
  }
}

TEST_F(AutomotivePair, AutoFindsThePoseFromAfar) {
  EXPECT_EQ(basin("auto", 1.0, 5.0, 5), 1.0);
  EXPECT_GE(basin("auto", 4.0, 20.0, 5), 0.6);
}

TEST_F(AutomotivePair, SoakAutoFindsThePoseFromEverywhereNear) {
  EXPECT_EQ(basin("auto", 1.0, 5.0, 100), 1.0);
  EXPECT_GE(basin("auto", 2.0, 10.0, 100), 0.9);
  EXPECT_GE(basin("auto", 4.0, 20.0, 100), 0.6);
}

TEST_F(AutomotivePair, WrongByFiftyMetresIsNeverConfident) {
  for (const double metres : {10.0, 20.0, 50.0}) {
    for (int i = 0; i < 4; ++i) {
      const double angle = 90.0 * kDegree * i;
      const Eigen::Isometry3d away(
          Eigen::Translation3d(metres * std::cos(angle), metres * std::sin(angle), 0.0));
      const RegistrationResult result =
          make_registration_method("auto")->provide(*target_, *source_, away * T_, {});
      EXPECT_TRUE(!is_usable(result.status) || metres_between(T_, result.T_target_source) < 0.2)
          << metres << " m, direction " << i;
    }
  }
}

class RobotScans : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path directory = kShared / "norlab_scans";
    if (!std::filesystem::exists(directory)) GTEST_SKIP() << "no clouds at " << directory;
    std::ifstream file(directory / "poses.txt");
    for (int i = 0; i < kNumScans; ++i) {
      poses_.push_back(read_rows(file));
      const std::string number = std::to_string(i);
      scans_.push_back(
          test::read_cloud(directory / (std::string(6 - number.size(), '0') + number + ".pcd")));
    }
  }
  /// All scans but one, in the world's frame.
  [[nodiscard]] MapWindow map_without(std::size_t left_out) const {
    std::vector<Vector3> points_world;
    for (std::size_t i = 0; i < scans_.size(); ++i) {
      if (i == left_out) continue;
      for (const Vector3& p : scans_[i]) points_world.push_back(poses_[i] * p);
    }
    return MapWindow(points_world);
  }
  void register_scan(std::size_t i) const {
    const RegistrationResult result =
        make_registration_method("auto")->provide(map_without(i), Scan(scans_[i]), poses_[i], {});
    EXPECT_EQ(result.status, RegistrationStatus::kConverged) << i << ": " << result.reason;
    EXPECT_LT(metres_between(poses_[i], result.T_target_source), 0.02) << i;
    EXPECT_LT(degrees_between(poses_[i], result.T_target_source), 0.2) << i;
  }

  static constexpr int kNumScans = 14;
  std::vector<Eigen::Isometry3d> poses_;
  std::vector<std::vector<Vector3>> scans_;
};

TEST_F(RobotScans, OneLiesInTheMapOfTheOthersWhereItIsSaidToBe) { register_scan(4); }

TEST_F(RobotScans, SoakEachLiesInTheMapOfTheOthersWhereItIsSaidToBe) {
  for (std::size_t i = 0; i < scans_.size(); ++i) register_scan(i);
}

}  // namespace
}  // namespace gdfmap
