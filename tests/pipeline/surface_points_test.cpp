#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/pipeline/field_access.hpp>
#include <gdfmap/pipeline/ingest.hpp>
#include <gdfmap/pipeline/model_exchange.hpp>
#include <gdfmap/pipeline/surface.hpp>
#include <gdfmap/train/train.hpp>

#include "support/map_fixture.hpp"
#include "support/ply_file.hpp"
#include "support/point_grid.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

/// A sphere of 1 m radius around the world's origin, where eight tiles meet.
class SurfacePointsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    directory_ = new test::TemporaryDirectory;
    Map map =
        test::map_of(*directory_ / "sphere.gdfmap", test::scene_points("sphere", 50000, 2.0), 0.5);
    train(map);
    export_model(map, *directory_ / "sphere.bin");
  }
  static void TearDownTestSuite() { delete directory_; }

  static test::PlyFile points(const SurfacePointsOptions& options, const RunContext& context = {},
                              const char* from = "sphere.gdfmap") {
    const auto out = *directory_ / "points.ply";
    report_ = write_surface_points(open_tile_source(*directory_ / from), options, out, context);
    return test::read_ply(out);
  }
  static SurfacePointsOptions at(double resolution) {
    SurfacePointsOptions options;
    options.range.resolution = resolution;
    return options;
  }

  static inline test::TemporaryDirectory* directory_;
  static inline SurfaceReport report_;
};

TEST_F(SurfacePointsTest, AreTheSamplesWithinTheThreshold) {
  SurfacePointsOptions options = at(0.05);
  options.sigmas = 0.0;
  const test::PlyFile file = points(options);
  EXPECT_EQ(file.properties, (std::vector<std::string>{"x", "y", "z", "distance"}));
  ASSERT_EQ(file.num_vertices(), report_.num_vertices);
  // A shell of twice the threshold, and the error of the field on either side.
  const double expected = 4.0 * M_PI * 0.1 / std::pow(0.05, 3);
  EXPECT_NEAR(static_cast<double>(file.num_vertices()), expected, 0.25 * expected);
  const DistanceField field(open_tile_source(*directory_ / "sphere.gdfmap"));
  const std::vector<Vector3> positions = file.positions();
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Vector3 multiples = positions[i] / 0.05;
    EXPECT_LT((multiples - multiples.array().round().matrix()).norm(), 1e-9);
    EXPECT_LT(std::abs(file.values.at("distance")[i]), 0.05);
    // Two ways to the same field: factors along axes here, the Gaussians themselves there.
    EXPECT_NEAR(file.values.at("distance")[i], field.at(positions[i]).distance, 1e-5);
  }
}

TEST_F(SurfacePointsTest, LeaveNoSampleOutAndHaveNoneTwice) {
  SurfacePointsOptions options = at(0.05);
  for (const double sigmas : {0.0, 1.0, 2.0, 10.0}) {
    options.sigmas = sigmas;
    const test::PlyFile file = points(options);
    std::set<std::array<double, 3>> written;
    for (const Vector3& p : file.positions()) written.insert({p.x(), p.y(), p.z()});
    EXPECT_EQ(written.size(), file.num_vertices());
    const DistanceField field(open_tile_source(*directory_ / "sphere.gdfmap"));
    std::size_t num_found = 0;
    for (int x = -25; x <= 25; ++x) {
      for (int y = -25; y <= 25; ++y) {
        for (int z = -25; z <= 25; ++z) {
          const FieldSample sample = field.at({0.05 * x, 0.05 * y, 0.05 * z});
          // The standard deviation of normal errors; a third of the threshold at most.
          const double sigma = std::sqrt(M_PI / 2.0) * sample.expected_error;
          const double counted = std::abs(sample.distance) + std::min(sigmas * sigma, 0.05 / 3.0);
          const bool is_written = written.contains({0.05 * x, 0.05 * y, 0.05 * z});
          // Beyond the threshold from every cube with points nothing is taken, whatever is stated.
          const double r = 0.05 * Vector3(x, y, z).norm();
          if (counted < 0.05 - 1e-4 && std::abs(r - 1.0) < 0.045) {
            ++num_found;
            EXPECT_TRUE(is_written);
          } else if (counted > 0.05 + 1e-4) {
            EXPECT_FALSE(is_written);
          }
        }
      }
    }
    EXPECT_GT(num_found, file.num_vertices() * 8 / 10) << sigmas;
  }
}

TEST_F(SurfacePointsTest, ProjectedOnesLieOnTheSphereWithItsNormals) {
  SurfacePointsOptions options = at(0.04);
  options.project = true;
  const test::PlyFile file = points(options);
  EXPECT_EQ(file.properties, (std::vector<std::string>{"x", "y", "z", "nx", "ny", "nz", "distance",
                                                       "expected_error"}));
  const std::vector<Vector3> positions = file.positions();
  const std::vector<Vector3> normals = file.vectors("nx", "ny", "nz");
  double error = 0.0, alignment = 0.0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    error += std::abs(positions[i].norm() - 1.0);
    alignment += std::abs(normals[i].dot(positions[i].normalized()));
    EXPECT_NEAR(normals[i].norm(), 1.0, 1e-5);
    EXPECT_GT(file.values.at("expected_error")[i], 0.0);
    EXPECT_LT(file.values.at("expected_error")[i], 0.03);
  }
  const auto count = static_cast<double>(positions.size());
  EXPECT_LE(error / count, 0.008);
  EXPECT_GE(alignment / count, 0.9);
}

TEST_F(SurfacePointsTest, ProjectedOnesOfAThinWallLieOnItsSides) {
  // Oblique to the cubes, whose Gaussians then see but one valley for both sides.
  constexpr double kThickness = 0.12;
  const Vector3 along(std::cos(0.6), std::sin(0.6), 0.0), across(-along.y(), along.x(), 0.0);
  std::vector<Vector3> wall;
  for (int i = 0; i < 200; ++i) {
    for (int j = 0; j < 130; ++j) {
      const Vector3 p = 0.015 * (i * along + j * Vector3::UnitZ());
      wall.push_back(p);
      wall.push_back(p + kThickness * across);
    }
  }
  {
    Map map = test::map_of(*directory_ / "wall.gdfmap", wall);
    train(map);
  }
  SurfacePointsOptions options = at(0.02);
  const test::PlyFile samples = points(options, {}, "wall.gdfmap");
  options.project = true;
  const test::PlyFile file = points(options, {}, "wall.gdfmap");
  EXPECT_EQ(report_.num_vertices + report_.num_left_out, samples.num_vertices());
  EXPECT_LT(report_.num_left_out, samples.num_vertices() / 5);
  double error = 0.0;
  std::array<int, 2> num_on_side{};
  for (const Vector3& p : file.positions()) {
    const double depth = p.dot(across);
    error += std::min(std::abs(depth), std::abs(depth - kThickness));
    ++num_on_side[depth < 0.5 * kThickness ? 0 : 1];
  }
  const auto count = static_cast<double>(file.num_vertices());
  EXPECT_LE(error / count, 0.015);  // a third of what stands in the middle of the wall
  RecordProperty("mean_error_m", std::to_string(error / count));
  RecordProperty("left_out", std::to_string(report_.num_left_out));
  for (const int on_side : num_on_side) EXPECT_GT(on_side, count / 4);
}

TEST_F(SurfacePointsTest, HaveTheSameBytesForAnyThreadsAndMemory) {
  for (const bool project : {false, true}) {
    SurfacePointsOptions options = at(0.02);
    options.project = project;
    RunContext context;
    context.num_threads = 1;
    context.memory_bytes = kMinMemoryBytes;
    points(options, context);
    const std::string alone = test::read_file(*directory_ / "points.ply");
    context.num_threads = 3;
    context.memory_bytes = std::size_t{1} << 30;
    points(options, context);
    EXPECT_TRUE(test::read_file(*directory_ / "points.ply") == alone);
  }
}

/// Cubes larger than a block are taken in several.
TEST_F(SurfacePointsTest, DoNotDependOnHowCubesAreDivided) {
  SurfacePointsOptions fine = at(0.0125);
  fine.range.region = Box3(Vector3(0.5, 0.5, 0.3), Vector3(0.9, 0.9, 0.6));
  const auto set_of = [](const test::PlyFile& file) {
    std::set<std::array<double, 3>> set;
    for (const Vector3& p : file.positions()) set.insert({p.x(), p.y(), p.z()});
    return set;
  };
  const auto all = set_of(points(fine));
  SurfacePointsOptions coarse = fine;
  coarse.range.resolution = 0.025;
  std::size_t num_even = 0;
  for (const auto& p : all) {
    const auto is_even = [](double v) { return std::lround(v / 0.0125) % 2 == 0; };
    num_even += is_even(p[0]) && is_even(p[1]) && is_even(p[2]) ? 1 : 0;
  }
  EXPECT_EQ(set_of(points(coarse)).size(), num_even);
  EXPECT_GT(num_even, 100u);
}

TEST_F(SurfacePointsTest, StayInTheRegion) {
  SurfacePointsOptions options = at(0.05);
  options.range.region = Box3(Vector3(-2, -2, 0.5), Vector3(0.25, 2, 0.75));
  const test::PlyFile file = points(options);
  EXPECT_GT(file.num_vertices(), 100u);
  for (const Vector3& p : file.positions()) {
    EXPECT_TRUE(p.z() >= 0.5 && p.z() < 0.75 && p.x() < 0.25) << p.transpose();
  }
  options.range.region = Box3(Vector3(50, 50, 50), Vector3(51, 51, 51));
  EXPECT_THROW(points(options), Error);
}

/// A model of one level says nothing beyond its cubes; its last cubes count up to their faces.
TEST_F(SurfacePointsTest, OfAModelAreThoseOfTheMap) {
  const test::PlyFile of_map = points(at(0.05));
  const test::PlyFile of_model = points(at(0.05), {}, "sphere.bin");
  const auto near = static_cast<double>(of_map.num_vertices());
  EXPECT_NEAR(static_cast<double>(of_model.num_vertices()), near, 0.02 * near);
}

TEST_F(SurfacePointsTest, OfCubesWithLargeErrorsAreLeftOut) {
  SurfacePointsOptions options = at(0.05);
  options.range.max_mae = 1e-6;
  EXPECT_EQ(points(options).num_vertices(), 0u);
  EXPECT_GT(report_.num_cubes_poor, 7u);
  EXPECT_EQ(report_.num_cubes, 0u);
}

TEST_F(SurfacePointsTest, RefuseWhatCannotBeMeant) {
  const auto refuses = [](SurfacePointsOptions options, const char* name = "a.ply") {
    EXPECT_THROW(write_surface_points(open_tile_source(*directory_ / "sphere.gdfmap"), options,
                                      *directory_ / name),
                 Error);
    EXPECT_FALSE(std::filesystem::exists(*directory_ / name));
  };
  refuses(at(0.05), "a.obj");
  refuses(at(0.0));
  refuses(at(std::nan("")));
  refuses(at(1.5));
  SurfacePointsOptions options;
  options.threshold = 1.5;
  refuses(options);
  options.threshold = std::nan("");
  refuses(options);
  options = {};
  options.range.max_mae = -1.0;
  refuses(options);
  for (const double sigmas : {-1.0, std::nan("")}) {
    options = {};
    options.sigmas = sigmas;
    refuses(options);
  }
}

/// A map of a scanned room: the edge of its cubes, and how far projected points may be from it on
/// average.
struct ScanMap {
  double cube_size, projected;
};
class SurfacePointsOfAScan : public testing::TestWithParam<ScanMap> {};

TEST_P(SurfacePointsOfAScan, CoverItAndLieOnIt) {
  const std::filesystem::path cloud =
      std::filesystem::path(GDFMAP_SHARED_DATA) / "hancock_room_crop.ply";
  if (!std::filesystem::exists(cloud)) GTEST_SKIP() << cloud << " is not there";
  const test::TemporaryDirectory directory;
  Map map = open_or_create_map(directory / "room.gdfmap", {GetParam().cube_size, 1});
  ingest(cloud, map);
  train(map);
  std::vector<Vector3> scan(1'000'000);
  scan.resize(open_point_cloud(cloud)->read(scan));
  constexpr double kRadius = 0.06;
  const test::PointGrid scan_grid(scan, kRadius);
  const auto points = [&](bool project) {
    SurfacePointsOptions options;
    options.project = project;
    write_surface_points(open_tile_source(directory / "room.gdfmap"), options,
                         directory / "points.ply");
    return test::read_ply(directory / "points.ply").positions();
  };
  // Of every fifth, which is enough for two digits.
  const auto mean = [](std::span<const Vector3> of, const auto& value) {
    double sum = 0.0;
    for (std::size_t i = 0; i < of.size(); i += 5) sum += value(of[i]);
    return sum / static_cast<double>((of.size() + 4) / 5);
  };
  const auto covered = [&](std::span<const Vector3> by) {
    const test::PointGrid grid(by, kRadius);
    return mean(scan, [&](const Vector3& p) { return grid.distance(p) <= kRadius ? 1.0 : 0.0; });
  };
  const std::vector<Vector3> samples = points(false), projected = points(true);
  const double within =
      mean(samples, [&](const Vector3& p) { return scan_grid.distance(p) <= 0.05 ? 1.0 : 0.0; });
  const double error = mean(projected, [&](const Vector3& p) {
    const double distance = scan_grid.distance(p);
    return std::isfinite(distance) ? distance : 2.0 * kRadius;
  });
  EXPECT_GE(within, 0.95);
  EXPECT_GE(covered(samples), 0.95);
  EXPECT_GE(covered(projected), 0.95);
  EXPECT_LE(error, GetParam().projected);
  RecordProperty("within_5_cm", std::to_string(within));
  RecordProperty("covered_to_6_cm", std::to_string(covered(samples)));
  RecordProperty("covered_by_projected", std::to_string(covered(projected)));
  RecordProperty("mean_projected_m", std::to_string(error));
}

INSTANTIATE_TEST_SUITE_P(, SurfacePointsOfAScan,
                         testing::Values(ScanMap{1.0, 0.015}, ScanMap{0.5, 0.0125}),
                         [](const auto& map) { return map.index == 0 ? "Metres" : "HalfMetres"; });

}  // namespace
}  // namespace gdfmap
