// Registration side by side with PCL's on the same clouds, one thread, without preprocessing: both
// thin to 0.25 m first, and trees, normals, covariances and cells are made before the clock runs. A
// pair of automotive scans (GDFMAP_SHARED_DATA/small_gicp_pair), and the first of the exact
// synthetic ones, over twenty of which the errors are means.

#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <pcl/features/normal_3d.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/ndt.h>

#include <gdfmap/align/registration.hpp>

#include "support/lidar_room.hpp"
#include "support/map_fixture.hpp"

namespace gdfmap {
namespace {

constexpr double kVoxel = 0.25;
constexpr double kMaxDistance = 1.0;
constexpr double kDegree = std::numbers::pi / 180.0;

test::LidarPair automotive_pair() {
  const std::filesystem::path directory =
      std::filesystem::path(GDFMAP_SHARED_DATA) / "small_gicp_pair";
  test::LidarPair pair{test::read_cloud(directory / "target.ply"),
                       test::read_cloud(directory / "source.ply"), Eigen::Isometry3d::Identity()};
  std::ifstream file(directory / "T_target_source.txt");
  for (int i = 0; i < 12; ++i) file >> pair.T_target_source.matrix()(i / 4, i % 4);
  return pair;
}

/// A registration of one pair, ready to run any number of times.
using Run = std::function<Eigen::Isometry3d()>;
using Prepare = std::function<Run(const test::LidarPair&)>;

Run prepare_ours(const char* method, const test::LidarPair& pair) {
  const auto target = std::make_shared<MapWindow>(pair.target);
  const auto source = std::make_shared<Scan>(pair.source);
  const auto how = std::shared_ptr<RegistrationMethod>(make_registration_method(method));
  const Run run = [=] {
    RegistrationOptions options;
    options.num_threads = 1;
    return how->provide(*target, *source, Eigen::Isometry3d::Identity(), options).T_target_source;
  };
  run();  // makes surfaces and cells
  return run;
}

using PclPoint = pcl::PointNormal;
using PclCloud = pcl::PointCloud<PclPoint>;

PclCloud::Ptr thinned(const std::vector<Vector3>& points) {
  const auto cloud = pcl::make_shared<PclCloud>();
  for (const Vector3& p : voxel_means(points, kVoxel)) {
    PclPoint point;
    point.getVector3fMap() = p.cast<float>();
    cloud->push_back(point);
  }
  pcl::NormalEstimation<PclPoint, PclPoint> normals;
  normals.setInputCloud(cloud);
  normals.setKSearch(SurfaceCloud::kNeighbors);
  normals.compute(*cloud);
  return cloud;
}

template <typename Registration>
Run prepare_pcl(std::shared_ptr<Registration> registration, const test::LidarPair& pair) {
  const PclCloud::Ptr target = thinned(pair.target), source = thinned(pair.source);
  registration->setInputTarget(target);
  registration->setInputSource(source);
  const auto aligned = std::make_shared<PclCloud>();
  registration->align(*aligned);  // trees and covariances
  return [=, keep_target = target, keep_source = source] {
    registration->align(*aligned);
    Eigen::Isometry3d T;
    T.matrix() = registration->getFinalTransformation().template cast<double>();
    return T;
  };
}

template <typename Icp>
Run prepare_pcl_icp(const test::LidarPair& pair) {
  auto icp = std::make_shared<Icp>();
  icp->setMaxCorrespondenceDistance(kMaxDistance);
  icp->setMaximumIterations(100);
  icp->setTransformationEpsilon(1e-8);
  return prepare_pcl(icp, pair);
}

Run prepare_pcl_ndt(const test::LidarPair& pair) {
  auto ndt = std::make_shared<pcl::NormalDistributionsTransform<PclPoint, PclPoint>>();
  ndt->setResolution(1.0F);
  ndt->setStepSize(0.1);
  ndt->setTransformationEpsilon(1e-6);  // compared with the squared step
  ndt->setMaximumIterations(100);
  return prepare_pcl(ndt, pair);
}

void report_mean_errors(benchmark::State& state, const Prepare& prepare,
                        const std::vector<test::LidarPair>& pairs) {
  double metres = 0.0, degrees = 0.0, failures = 0.0;
  for (const test::LidarPair& pair : pairs) {
    const Eigen::Isometry3d error = pair.T_target_source.inverse() * prepare(pair)();
    metres += error.translation().norm();
    degrees += rotation_angle(error) / kDegree;
    if (error.translation().norm() > 0.1) failures += 1.0;
  }
  const double n = static_cast<double>(pairs.size());
  state.counters["mm"] = 1e3 * metres / n;
  state.counters["degrees"] = degrees / n;
  state.counters["failures"] = failures;
}

void register_pairs(benchmark::State& state, const Prepare& prepare,
                    const std::vector<test::LidarPair>& pairs) {
  const Run run = prepare(pairs.front());
  for (auto _ : state) benchmark::DoNotOptimize(run());
  report_mean_errors(state, prepare, pairs);
}

const std::vector<test::LidarPair>& automotive_pairs() {
  static const std::vector<test::LidarPair> pairs = {automotive_pair()};
  return pairs;
}

const std::vector<test::LidarPair>& synthetic_pairs() {
  static const std::vector<test::LidarPair> pairs = [] {
    std::vector<test::LidarPair> result;
    for (std::uint32_t i = 0; i < 20; ++i) result.push_back(test::lidar_pair(i));
    return result;
  }();
  return pairs;
}

void add(const std::string& name, const Prepare& prepare) {
  if (std::filesystem::exists(std::filesystem::path(GDFMAP_SHARED_DATA) / "small_gicp_pair")) {
    benchmark::RegisterBenchmark(
        ("register_automotive/" + name).c_str(),
        [=](benchmark::State& state) { register_pairs(state, prepare, automotive_pairs()); })
        ->Unit(benchmark::kMillisecond);
  }
  benchmark::RegisterBenchmark(
      ("register_synthetic/" + name).c_str(),
      [=](benchmark::State& state) { register_pairs(state, prepare, synthetic_pairs()); })
      ->Unit(benchmark::kMillisecond);
}

}  // namespace
}  // namespace gdfmap

int main(int argc, char** argv) {
  using namespace gdfmap;
  for (const char* const method : {"icp-point", "icp-plane", "gicp", "gradicp", "ndt", "auto"}) {
    add(method, [method](const test::LidarPair& pair) { return prepare_ours(method, pair); });
  }
  add("pcl_icp", prepare_pcl_icp<pcl::IterativeClosestPoint<PclPoint, PclPoint>>);
  add("pcl_icp_normals",
      prepare_pcl_icp<pcl::IterativeClosestPointWithNormals<PclPoint, PclPoint>>);
  add("pcl_gicp", prepare_pcl_icp<pcl::GeneralizedIterativeClosestPoint<PclPoint, PclPoint>>);
  add("pcl_ndt", prepare_pcl_ndt);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
