#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/field_access.hpp>
#include <gdfmap/pipeline/surface.hpp>
#include <gdfmap/pipeline/synthetic_scene.hpp>
#include <gdfmap/train/train.hpp>

#include "pipeline/surface/cell_triangles.hpp"
#include "support/map_fixture.hpp"
#include "support/ply_file.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

using Triangles = std::vector<std::array<std::int64_t, 3>>;

/// How often each edge is gone along, in either direction.
std::map<std::pair<std::int64_t, std::int64_t>, std::array<int, 2>> edges_of(
    const Triangles& triangles) {
  std::map<std::pair<std::int64_t, std::int64_t>, std::array<int, 2>> edges;
  for (const auto& triangle : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int64_t a = triangle[i], b = triangle[(i + 1) % 3];
      ++edges[std::minmax(a, b)][a < b ? 0 : 1];
    }
  }
  return edges;
}

/// Whether two triangles meet at every edge, facing the same way, every vertex is used, and none is
/// there twice.
void expect_closed(const test::PlyFile& mesh) {
  ASSERT_GT(mesh.triangles.size(), 1000u);
  std::size_t num_wrong = 0;
  for (const auto& [edge, uses] : edges_of(mesh.triangles)) {
    num_wrong += uses == std::array{1, 1} ? 0 : 1;
  }
  EXPECT_EQ(num_wrong, 0u);
  std::set<std::array<double, 3>> places;
  for (const Vector3& p : mesh.positions()) places.insert({p.x(), p.y(), p.z()});
  EXPECT_EQ(places.size(), mesh.num_vertices());
  std::set<std::int64_t> used;
  for (const auto& triangle : mesh.triangles) used.insert(triangle.begin(), triangle.end());
  EXPECT_EQ(used.size(), mesh.num_vertices());
  EXPECT_EQ(*used.rbegin() + 1, static_cast<std::int64_t>(mesh.num_vertices()));
}

/// Of points spread over the triangles by area.
double mean_distance(const test::PlyFile& mesh, const SyntheticScene& truth) {
  const std::vector<Vector3> p = mesh.positions();
  double sum = 0.0, area = 0.0;
  for (const auto& t : mesh.triangles) {
    const Vector3 a = p[static_cast<std::size_t>(t[0])], b = p[static_cast<std::size_t>(t[1])],
                  c = p[static_cast<std::size_t>(t[2])];
    const double size = 0.5 * (b - a).cross(c - a).norm();
    sum += size * truth.distance((a + b + c) / 3.0);
    area += size;
  }
  return sum / area;
}

/// Share of the scene's points that have a vertex in their voxel of 3 cm or next to it.
double covered_share(const test::PlyFile& mesh, const std::string& scene, double size) {
  const auto voxel_of = [](const Vector3& p) {
    const Eigen::Array3i v = (p.array() / 0.03).floor().cast<int>();
    return std::array<int, 3>{v.x(), v.y(), v.z()};
  };
  std::set<std::array<int, 3>> near;
  for (const Vector3& p : mesh.positions()) {
    for (int i = 0; i < 27; ++i) {
      const Vector3 offset(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1);
      near.insert(voxel_of(p + 0.03 * offset));
    }
  }
  const std::vector<Vector3> points = test::scene_points(scene, 5000, size);
  const auto count =
      std::ranges::count_if(points, [&](const Vector3& p) { return near.contains(voxel_of(p)); });
  return static_cast<double>(count) / static_cast<double>(points.size());
}

/// Scenes around the world's origin, where eight tiles meet.
class SurfaceMeshTest : public testing::Test {
 protected:
  std::shared_ptr<TileSource> trained(const std::string& scene, double size,
                                      double cube_size = 1.0) {
    const auto path = directory_ / (scene + ".gdfmap");
    Map map = test::map_of(path, test::scene_points(scene, 60000, size), cube_size);
    train(map);
    return open_tile_source(path);
  }
  test::PlyFile mesh(const std::shared_ptr<TileSource>& source, const SurfaceMeshOptions& options,
                     const RunContext& context = {}) {
    report_ = write_surface_mesh(source, options, directory_ / "mesh.ply", context);
    return test::read_ply(directory_ / "mesh.ply");
  }
  static SurfaceMeshOptions at(double resolution) {
    SurfaceMeshOptions options;
    options.range.resolution = resolution;
    return options;
  }

  test::TemporaryDirectory directory_;
  SurfaceReport report_;
};

TEST_F(SurfaceMeshTest, OfASphereAcrossTilesIsClosedAndOnIt) {
  const test::PlyFile file = mesh(trained("sphere", 2.0), at(0.02));
  expect_closed(file);
  EXPECT_GE(covered_share(file, "sphere", 2.0), 0.99);
  EXPECT_EQ(report_.num_vertices, file.num_vertices());
  EXPECT_EQ(report_.num_triangles, file.triangles.size());
  const double error = mean_distance(file, SyntheticScene("sphere", 2.0));
  EXPECT_LE(error, 0.015);
  RecordProperty("mean_distance_m", std::to_string(error));
}

/// All faces of the box are faces of cubes: either side is another cube's.
TEST_F(SurfaceMeshTest, OfABoxAcrossTilesIsClosedAndOnIt) {
  const test::PlyFile file = mesh(trained("box", 2.0, 0.5), at(0.02));
  expect_closed(file);
  EXPECT_GE(covered_share(file, "box", 2.0), 0.999);
  const double error = mean_distance(file, SyntheticScene("box", 2.0));
  EXPECT_LE(error, 0.015);
  RecordProperty("mean_distance_m", std::to_string(error));
}

TEST_F(SurfaceMeshTest, OfABoxInCubesOfAMetreIsOnIt) {
  const test::PlyFile file = mesh(trained("box", 4.0), at(0.04));
  EXPECT_GE(covered_share(file, "box", 4.0), 0.99);
  const double error = mean_distance(file, SyntheticScene("box", 4.0));
  EXPECT_LE(error, 0.015);
  RecordProperty("mean_distance_m", std::to_string(error));
}

TEST_F(SurfaceMeshTest, AShellStaysAtTheThresholdAndFacesAway) {
  SurfaceMeshOptions options = at(0.03);
  options.shell = true;
  options.threshold = 0.06;
  const auto source = trained("sphere", 2.0, 0.5);
  const test::PlyFile file = mesh(source, options);
  expect_closed(file);
  const DistanceField field(source);
  const std::vector<Vector3> positions = file.positions(), normals = file.vectors("nx", "ny", "nz");
  double error = 0.0;
  for (const Vector3& p : positions) error += std::abs(field.at(p).distance - 0.06);
  EXPECT_LE(error / static_cast<double>(positions.size()), 0.002);
  std::size_t num_outwards = 0;
  for (const auto& t : file.triangles) {
    const auto at = [&](std::size_t i) { return positions[static_cast<std::size_t>(t[i])]; };
    const Vector3 facing = (at(1) - at(0)).cross(at(2) - at(0));
    num_outwards += facing.dot(normals[static_cast<std::size_t>(t[0])]) > 0.0 ? 1 : 0;
  }
  EXPECT_GE(num_outwards, file.triangles.size() * 98 / 100);
}

TEST_F(SurfaceMeshTest, IsClosedWhereTheRegionCutsIt) {
  SurfaceMeshOptions options = at(0.03);
  options.range.region = Box3(Vector3(-0.4, -2.0, -0.3), Vector3(2.0, 0.55, 2.0));
  const auto source = trained("sphere", 2.0, 0.5);
  const test::PlyFile file = mesh(source, options);
  expect_closed(file);
  for (const Vector3& p : file.positions()) EXPECT_GT(p.x(), -0.5) << p.transpose();
}

TEST_F(SurfaceMeshTest, HasTheSameBytesForAnyThreadsAndMemory) {
  const auto source = trained("box", 2.0);
  RunContext context;
  context.num_threads = 1;
  context.memory_bytes = kMinMemoryBytes;
  mesh(source, at(0.025), context);
  const std::string alone = test::read_file(directory_ / "mesh.ply");
  context.num_threads = 3;
  context.memory_bytes = std::size_t{1} << 30;
  mesh(source, at(0.025), context);
  EXPECT_TRUE(test::read_file(directory_ / "mesh.ply") == alone);
}

/// Cubes of more samples than a block holds, so that blocks meet within cubes.
TEST_F(SurfaceMeshTest, IsClosedWhereBlocksMeet) {
  SurfaceMeshOptions options = at(0.007);
  options.threshold = 0.06;
  options.range.region = Box3(Vector3(-0.2, -0.2, 0.8), Vector3(0.7, 0.7, 1.2));
  expect_closed(mesh(trained("box", 2.0), options));
}

TEST_F(SurfaceMeshTest, ObjHoldsTheSameMesh) {
  const auto source = trained("sphere", 1.0);
  const test::PlyFile file = mesh(source, at(0.04));
  write_surface_mesh(source, at(0.04), directory_ / "mesh.obj");
  std::istringstream obj(test::read_file(directory_ / "mesh.obj"));
  std::vector<Vector3> positions;
  Triangles triangles;
  for (std::string line; std::getline(obj, line);) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "v") {
      Vector3 p;
      words >> p.x() >> p.y() >> p.z();
      positions.push_back(p);
    } else if (keyword == "f") {
      auto& triangle = triangles.emplace_back();
      for (std::int64_t& index : triangle) {
        std::string corner;
        words >> corner;
        index = std::stoll(corner) - 1;
        EXPECT_LT(index, static_cast<std::int64_t>(positions.size())) << "comes behind";
      }
    }
  }
  EXPECT_EQ(positions, file.positions());
  EXPECT_EQ(triangles, file.triangles);
}

TEST_F(SurfaceMeshTest, RefusesWhatCannotBeMeant) {
  const auto source = trained("sphere", 1.0);
  const auto refuses = [&](const SurfaceMeshOptions& options, const char* name) {
    EXPECT_THROW(write_surface_mesh(source, options, directory_ / name), Error);
    EXPECT_FALSE(std::filesystem::exists(directory_ / name));
  };
  refuses(at(0.02), "mesh.stl");
  refuses(at(0.10), "mesh.ply");  // samples farther apart than the shell is thick
  SurfaceMeshOptions options;
  options.threshold = 2.0;
  refuses(options, "mesh.ply");
}

/// Two cells share a face; whatever is inside, what one leaves open there the other one closes.
TEST(CellTriangles, CloseAcrossFacesForAnyCorners) {
  using surface::cell_edges;
  using surface::cell_triangles;
  // Corners at (x, y, z) with x from 0 to 2: the cells of x 0 to 1 and 1 to 2.
  for (unsigned corners = 0; corners < 1u << 12; ++corners) {
    Triangles triangles;
    for (int cell = 0; cell < 2; ++cell) {
      const auto name = [&](const surface::CellEdge& edge) {
        const int x = cell + (edge.corner & 1), yz = edge.corner >> 1;
        return std::int64_t{3} * (x + 3 * yz) + edge.axis;
      };
      unsigned inside = 0;
      for (int c = 0; c < 8; ++c) {
        inside |= (corners >> (cell + (c & 1) + 3 * (c >> 1)) & 1u) << c;
      }
      for (const auto& edges : cell_triangles(static_cast<std::uint8_t>(inside))) {
        triangles.push_back({name(cell_edges()[edges[0]]), name(cell_edges()[edges[1]]),
                             name(cell_edges()[edges[2]])});
      }
    }
    for (const auto& [edge, uses] : edges_of(triangles)) {
      // At most once each way, and both ways unless both ends are on an outer face.
      const auto x_of = [](std::int64_t v) { return v / 3 % 3; };
      const bool is_between = x_of(edge.first) == 1 && x_of(edge.second) == 1 &&
                              edge.first % 3 != 0 && edge.second % 3 != 0;
      ASSERT_LE(uses[0], 1) << corners;
      ASSERT_LE(uses[1], 1) << corners;
      if (is_between) {
        ASSERT_EQ(uses[0], uses[1]) << corners;
      }
    }
  }
}

}  // namespace
}  // namespace gdfmap
