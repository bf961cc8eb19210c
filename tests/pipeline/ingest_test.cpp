#include <fstream>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/ingest.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

class PipelineIngestTest : public testing::Test {
 protected:
  Eigen::Isometry3d read(const std::string& text) {
    std::ofstream(directory_ / "T.txt") << text;
    return read_transform(directory_ / "T.txt");
  }
  test::TemporaryDirectory directory_;
};

TEST_F(PipelineIngestTest, ReadsARigidTransform) {
  const Eigen::Isometry3d T = read("0 -1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n");
  EXPECT_TRUE((T * Vector3(1, 0, 0)).isApprox(Vector3(1, 3, 3)));
}

TEST_F(PipelineIngestTest, RefusesWhatIsNotRigid) {
  EXPECT_THROW(read("2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1"), Error);
  EXPECT_THROW(read("1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1"), Error);
  EXPECT_THROW(read("1 0 0 0 0 1 0 0"), Error);
  EXPECT_THROW(read("nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"), Error);
  EXPECT_THROW(read_transform(directory_ / "none.txt"), Error);
}

TEST_F(PipelineIngestTest, ScaleComesBeforeTheTransform) {
  test::write_cloud(directory_ / "a.ply", std::vector<Vector3>{{10, 0, 0}});
  Map map = open_or_create_map(directory_ / "a.gdfmap", {});
  IngestOptions options;
  options.transform.scale = 0.5;
  options.transform.T_map_source.translation() = Vector3(100.25, 0.25, 0.25);
  ingest(directory_ / "a.ply", map, options);
  const auto tile = map.points().find_tile({0, 13, 0, 0});
  ASSERT_TRUE(tile);
  EXPECT_TRUE(tile->cubes.test(1));  // 5 + 100.25 m: cube 105 = 8 · 13 + 1
}

TEST_F(PipelineIngestTest, TheSameCloudAgainChangesNothing) {
  test::write_cloud(directory_ / "a.ply", test::scene_points("sphere", 100));
  Map map = open_or_create_map(directory_ / "a.gdfmap", {});
  EXPECT_FALSE(ingest(directory_ / "a.ply", map).already_present);
  EXPECT_TRUE(ingest(directory_ / "a.ply", map).already_present);
  EXPECT_EQ(map.points().sources().size(), 1u);
}

TEST_F(PipelineIngestTest, TheGeometryOfAMapIsFixed) {
  { Map map = open_or_create_map(directory_ / "a.gdfmap", {2.0, 2}); }
  EXPECT_NO_THROW(open_or_create_map(directory_ / "a.gdfmap", {{}, 2}));
  EXPECT_THROW(open_or_create_map(directory_ / "a.gdfmap", {{}, 3}), Error);
  EXPECT_NO_THROW(open_or_create_map(directory_ / "a.gdfmap", {2.0, {}}));
  EXPECT_NO_THROW(open_or_create_map(directory_ / "a.gdfmap", {}));
  EXPECT_THROW(open_or_create_map(directory_ / "a.gdfmap", {1.0, {}}), Error);
}

TEST_F(PipelineIngestTest, EstimatesFromTheOccupiedCubes) {
  Map map = test::map_of(directory_ / "a.gdfmap", {{{0.5, 0.5, 0.5}, {1.5, 0.5, 0.5}}});
  EXPECT_EQ(estimate_training(map).num_cubes, 8u);
  EXPECT_GT(estimate_training(map).num_bytes, 0u);
}

}  // namespace
}  // namespace gdfmap
