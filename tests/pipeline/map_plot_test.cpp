#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/ingest.hpp>
#include <gdfmap/pipeline/map_plot.hpp>
#include <gdfmap/pipeline/model_exchange.hpp>
#include <gdfmap/train/train.hpp>

#include "picture.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

const TileColumn* find(const MapFromAbove& map, int x, int y) {
  for (const TileColumn& column : map.columns) {
    if (column.x == x && column.y == y) return &column;
  }
  return nullptr;
}

class MapFromAboveTest : public testing::Test {
 protected:
  /// Adds points in the middle of a tile, four of them above each other.
  void add_tile(Map& map, int x, int y) {
    std::vector<Vector3> points;
    for (const double z : {4.0, 4.1, 12.0, -4.0}) points.emplace_back(8 * x + 4, 8 * y + 4, z);
    const auto cloud = directory_ / (std::to_string(x) + "_" + std::to_string(y) + ".ply");
    test::write_cloud(cloud, points);
    ingest(cloud, map);
  }
  test::TemporaryDirectory directory_;
};

TEST_F(MapFromAboveTest, TellsTrainedFromStaleFromUntrained) {
  Map map = open_or_create_map(directory_ / "a.gdfmap", {1.0, 1});
  add_tile(map, 0, 0);
  add_tile(map, 3, 0);
  MapFromAbove view = look_from_above(map);
  ASSERT_NE(find(view, 3, 0), nullptr);
  EXPECT_EQ(find(view, 3, 0)->state, TrainingState::kUntrained);
  EXPECT_EQ(find(view, 3, 0)->num_points, 4u);

  train(map);
  view = look_from_above(map);
  for (const TileColumn& column : view.columns) EXPECT_EQ(column.state, TrainingState::kTrained);

  test::write_cloud(directory_ / "more.ply", std::vector<Vector3>{{27.0, 4.0, 4.0}});
  ingest(directory_ / "more.ply", map);
  add_tile(map, 8, 8);
  view = look_from_above(map);
  EXPECT_EQ(find(view, 0, 0)->state, TrainingState::kTrained);
  EXPECT_EQ(find(view, 3, 0)->state, TrainingState::kStale);
  EXPECT_EQ(find(view, 3, 0)->num_points, 5u);
  EXPECT_EQ(find(view, 8, 8)->state, TrainingState::kUntrained);
  EXPECT_EQ(find(view, 5, 5), nullptr);
}

TEST_F(MapFromAboveTest, MarksPoorCubes) {
  Map map = open_or_create_map(directory_ / "a.gdfmap", {1.0, 1});
  test::write_cloud(directory_ / "a.ply", test::scene_points("sphere", 2000, 3.0));
  ingest(directory_ / "a.ply", map);
  FitConfig config;
  config.mae_threshold_max = 1e-5;
  train(map, {.config = config});
  EXPECT_EQ(find(look_from_above(map), 0, 0)->state, TrainingState::kPoor);
}

TEST_F(MapFromAboveTest, ImportedMapsHaveCubesAlone) {
  {
    Map map = open_or_create_map(directory_ / "a.gdfmap", {1.0, 1});
    add_tile(map, 1, 2);
    train(map);
    export_model(map, directory_ / "a.bin");
  }
  import_model(directory_ / "a.bin", directory_ / "b.gdfmap");
  Map map = Map::open(directory_ / "b.gdfmap", Access::kRead);
  const MapFromAbove view = look_from_above(map);
  ASSERT_NE(find(view, 1, 2), nullptr);
  EXPECT_EQ(find(view, 1, 2)->num_points, 0u);
  EXPECT_EQ(find(view, 1, 2)->state, TrainingState::kTrained);
}

MapFromAbove every_state() {
  MapFromAbove map;
  for (int y = -2; y < 3; ++y) {
    for (int x = 0; x < 7; ++x) {
      if (x + y == 6) continue;
      const auto points = static_cast<std::uint64_t>(y == 2 ? 0 : 30 << (2 * x));
      map.columns.push_back({x, y, points, static_cast<TrainingState>(y == 2 ? 0 : y + 2)});
    }
  }
  return map;
}

TEST_F(MapFromAboveTest, LooksAsItDid) {
  draw_from_above(every_state(), directory_ / "a.png");
  test::expect_golden(directory_ / "a.png", "map_from_above");
}

TEST_F(MapFromAboveTest, ManyColumnsAreMerged) {
  MapFromAbove map;
  map.columns = {{-1'000'000, 5, 100, TrainingState::kTrained},
                 {1'000'000'000, 7, 100, TrainingState::kStale}};
  draw_from_above(map, directory_ / "far.png");
  const test::Picture picture(directory_ / "far.png");
  EXPECT_LT(picture.width(), 1500);
  EXPECT_LT(picture.height(), 1500);
}

TEST_F(MapFromAboveTest, NothingIsNotDrawn) {
  EXPECT_THROW(draw_from_above({}, directory_ / "a.png"), Error);
}

}  // namespace
}  // namespace gdfmap
