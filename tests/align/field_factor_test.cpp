#include <cmath>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include <gdfmap/align/field_factor.hpp>
#include <gdfmap/align/registration.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/train/train.hpp>

#include "align_fixtures.hpp"
#include "support/lidar_room.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

/// A trained map of a corner of a room, 3 m wide.
class Corner : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    directory_ = std::make_unique<test::TemporaryDirectory>();
    map_ = std::make_unique<Map>(
        test::map_of(*directory_ / "corner.gdfmap", test::corner_points(30'000, 3.0, 0.0, 1)));
    TrainOptions options;
    options.config = test::quick_fit_config();
    train(*map_, options);
  }
  static void TearDownTestSuite() {
    map_.reset();
    directory_.reset();
  }
  static std::shared_ptr<const DistanceField> field(Precision precision) {
    DistanceFieldOptions options;
    options.precision = precision;
    return std::make_shared<const DistanceField>(*map_, options);
  }

  static std::unique_ptr<test::TemporaryDirectory> directory_;
  static std::unique_ptr<Map> map_;
};
std::unique_ptr<test::TemporaryDirectory> Corner::directory_;
std::unique_ptr<Map> Corner::map_;

TEST_F(Corner, GradientIsThatOfTheCostAlsoWhereCubesBlend) {
  const auto distances = field(Precision::kDouble);
  const Vector3 origin(0.5, -0.25, 0.125);
  // Near faces, edges and corners of cubes, and inside of them.
  for (const Vector3& p_world : {Vector3(1.02, 1.5, 0.4), Vector3(0.9, 1.1, 0.3),
                                 Vector3(1.1, 1.95, 1.05), Vector3(0.5, 0.5, 0.5)}) {
    const std::vector<Vector3> source = {p_world - origin};
    FieldFactor factor(*distances, origin, source, {});
    const Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    factor.match(T);
    ASSERT_EQ(factor.num_matched(), 1u);
    const RobustKernel kernel{KernelKind::kCauchy, 0.3};
    const Twist gradient = factor.linearize(T, kernel).gradient;
    const Twist expected = test::difference_gradient(factor, T, kernel);
    EXPECT_LT((gradient - expected).norm(), 1e-4 * expected.norm()) << p_world.transpose();
    EXPECT_GT(expected.norm(), 1e-3);
  }
}

TEST_F(Corner, PointsOutsideTheFieldCostAConstant) {
  const auto distances = field(Precision::kFloat);
  const std::vector<Vector3> source = {{1.0, 1.0, 0.1}, {500.0, 0.0, 0.0}};
  FieldFactor factor(*distances, Vector3::Zero(), source, {0.7, 1});
  const Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  factor.match(T);
  EXPECT_EQ(factor.num_matched(), 1u);
  const RobustKernel kernel{KernelKind::kCauchy, 0.3};
  const double distance = distances->at(source[0]).distance;
  EXPECT_NEAR(factor.cost(T, kernel), 0.5 * (kernel.cost(distance) + kernel.cost(0.7)), 1e-9);
  const Eigen::Isometry3d away(Eigen::Translation3d(900.0, 0.0, 0.0));
  EXPECT_NEAR(factor.cost(away, kernel), kernel.cost(0.7), 1e-12);
}

TEST_F(Corner, SidesGiveTheSignedDistanceOfAPlane) {
  const auto distances = field(Precision::kFloat);
  const RobustKernel kernel{KernelKind::kNone, 0.0};
  std::vector<Vector3> floor;
  for (const Vector3& p : test::corner_points(3'000, 1.0, 0.0, 3)) {
    if (p.z() == 0.0) floor.push_back(p + Vector3(1.0, 1.0, 0.0));
  }
  const SurfaceCloud source(floor, 0.1, 1);
  ASSERT_GT(source.size(), 50u);
  TwoSidedFieldFactor factor(*distances, Vector3::Zero(), source, {});
  for (const double z : {-0.1, -0.02, 0.0, 0.05, 0.1}) {
    const Eigen::Isometry3d T(Eigen::Translation3d(0.0, 0.0, z));
    factor.match(T);
    EXPECT_EQ(factor.num_matched(), source.size()) << z;
    // Half the mean square of the distance, its derivative, and the square of a unit gradient.
    const Linearization sum = factor.linearize(T, kernel);
    EXPECT_NEAR(sum.gradient.z(), z, 0.01) << z;
    EXPECT_NEAR(sum.hessian(2, 2), 1.0, 0.2) << z;
    EXPECT_NEAR(sum.cost, 0.5 * z * z, 2e-3) << z;
  }
  factor.match(Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, 0.9)));
  EXPECT_EQ(factor.num_matched(), 0u) << "the surface lies outside of both sides";
}

TEST_F(Corner, GradientOfSidesIsThatOfTheCost) {
  const auto distances = field(Precision::kDouble);
  const Vector3 origin(0.5, -0.25, 0.125);
  std::vector<Vector3> points = test::corner_points(2'000, 2.0, 0.01, 4);
  for (Vector3& p : points) p -= origin;
  const SurfaceCloud source(points, 0.25, 1);
  TwoSidedFieldFactor factor(*distances, origin, source, {});
  std::mt19937 random(5);
  const RobustKernel kernel{KernelKind::kCauchy, 0.1};
  for (int i = 0; i < 5; ++i) {
    const Eigen::Isometry3d T = test::random_pose(random, 0.1, 0.05);
    factor.match(T);
    EXPECT_GT(factor.num_matched(), source.size() / 4);
    const Twist gradient = factor.linearize(T, kernel).gradient;
    const Twist expected = test::difference_gradient(factor, T, kernel);
    EXPECT_LT((gradient - expected).norm(), 1e-4 * expected.norm());
  }
}

/// What a method makes of a pair of scans, the first of which is a trained map.
Eigen::Isometry3d error_of(const char* method, const MapWindow& window,
                           const test::LidarPair& pair) {
  const RegistrationResult result = make_registration_method(method)->provide(
      window, Scan(pair.source), Eigen::Isometry3d::Identity(), {});
  EXPECT_EQ(result.status, RegistrationStatus::kConverged) << result.reason;
  return pair.T_target_source.inverse() * result.T_target_source;
}

/// Calls use(window) with the trained map of a pair's target.
template <typename Use>
void with_trained_map(const test::LidarPair& pair, const Use& use) {
  const test::TemporaryDirectory directory;
  Map map = test::map_of(directory / "room.gdfmap", pair.target);
  train(map);
  MapWindow::MapOptions options;
  options.field = std::make_shared<const DistanceField>(map);
  use(MapWindow(map, pair.source, options));
}

TEST(FieldMethod, FindsThePoseOfALidarInATrainedMap) {
  const test::LidarPair pair = test::lidar_pair(1);
  with_trained_map(pair, [&](const MapWindow& window) {
    const Eigen::Isometry3d error = error_of("field", window, pair);
    EXPECT_LT(error.translation().norm(), 0.0015);
    EXPECT_LT(rotation_angle(error), 0.0002);
  });
}

TEST(FieldMethod, SoakIsAsExactAsPlanesOverTwentyLidarPairs) {
  constexpr std::uint32_t kPairs = 20;
  double of_field = 0.0, of_planes = 0.0;
  for (std::uint32_t i = 0; i < kPairs; ++i) {
    const test::LidarPair pair = test::lidar_pair(i);
    with_trained_map(pair, [&](const MapWindow& window) {
      of_field += error_of("field", window, pair).translation().norm() / kPairs;
      of_planes += error_of("icp-plane", window, pair).translation().norm() / kPairs;
    });
  }
  RecordProperty("millimetres_of_field", std::to_string(1e3 * of_field));
  RecordProperty("millimetres_of_planes", std::to_string(1e3 * of_planes));
  EXPECT_LT(of_field, 1.5 * of_planes);
}

TEST_F(Corner, AScanOutsideTheFieldIsRejectedLoudly) {
  std::vector<Vector3> scan = test::corner_points(20'000, 3.0, 0.005, 2);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    scan[i].x() += 40.0 * static_cast<double>(i / 3 % 5);
  }
  MapWindow::MapOptions options;
  options.field = field(Precision::kFloat);
  const MapWindow window(*map_, scan, options);
  const RegistrationResult result = make_registration_method("field")->provide(
      window, Scan(scan), Eigen::Isometry3d::Identity(), {});
  EXPECT_EQ(result.status, RegistrationStatus::kRejected);
  EXPECT_NE(result.reason.find("field"), std::string::npos) << result.reason;
}

TEST(FieldMethod, IsRefusedWithoutAField) {
  const std::vector<Vector3> cloud = test::corner_points(5000, 3.0, 0.0, 1);
  EXPECT_THROW(make_registration_method("field")->provide(MapWindow(cloud), Scan(cloud),
                                                          Eigen::Isometry3d::Identity(), {}),
               Error);
}

}  // namespace
}  // namespace gdfmap
