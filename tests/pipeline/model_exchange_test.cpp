#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/morton.hpp>
#include <gdfmap/pipeline/field_access.hpp>
#include <gdfmap/pipeline/model_exchange.hpp>
#include <gdfmap/train/train.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

TrainOptions quick_options() { return {test::quick_fit_config(5), false}; }

class ModelExchangeTest : public testing::Test {
 protected:
  ModelExchangeTest()
      : map_(test::map_of(directory_ / "a.gdfmap", test::scene_points("box", 3000))) {
    train(map_, quick_options());
  }
  test::TemporaryDirectory directory_;
  Map map_;
};

TEST_F(ModelExchangeTest, ExportsEveryFittedCubeInMortonOrder) {
  const ExportReport report = export_model(map_, directory_ / "a.bin");
  const CubeTotals totals = map_.cubes().totals();
  EXPECT_EQ(static_cast<std::int64_t>(report.num_cubes), totals.num_cubes - totals.num_poor);
  const Model model = read_model(directory_ / "a.bin");
  ASSERT_EQ(model.cubes.size(), report.num_cubes);
  EXPECT_EQ(model.counts.num_dropped_gaussians, 0u);
  for (std::size_t i = 1; i < model.cubes.size(); ++i) {
    const CubeKey &a = model.cubes[i - 1].key, &b = model.cubes[i].key;
    EXPECT_TRUE(morton_less({a.x, a.y, a.z}, {b.x, b.y, b.z}));
  }
}

TEST_F(ModelExchangeTest, AFileAnswersAsTheMapDoes) {
  export_model(map_, directory_ / "a.bin");
  export_model(map_, directory_ / "a.csv");
  const DistanceField of_map(open_tile_source(directory_ / "a.gdfmap"));
  const DistanceField of_bin(open_tile_source(directory_ / "a.bin"));
  const DistanceField of_csv(open_tile_source(directory_ / "a.csv"));
  for (const Vector3& p : test::scene_points("sphere", 200)) {
    const FieldSample expected = of_map.at(p);
    if (expected.status != FieldStatus::kFine) continue;
    for (const DistanceField* field : {&of_bin, &of_csv}) {
      EXPECT_NEAR(field->at(p).distance, expected.distance, 1e-5);
      EXPECT_LE((field->at(p).gradient - expected.gradient).norm(), 1e-3);
    }
  }
}

TEST_F(ModelExchangeTest, ImportingAnExportGivesTheSameField) {
  export_model(map_, directory_ / "a.bin");
  const ImportReport report = import_model(directory_ / "a.bin", directory_ / "b.gdfmap");
  EXPECT_GT(report.num_cubes, 0u);
  Map imported = Map::open(directory_ / "b.gdfmap", Access::kWrite);
  EXPECT_TRUE(imported.is_imported());
  EXPECT_THROW(train(imported), Error);
  // Exported again it is the same file: positions survive the round trip bit by bit.
  export_model(imported, directory_ / "b.bin");
  EXPECT_EQ(test::read_file(directory_ / "b.bin").size(),
            test::read_file(directory_ / "a.bin").size());
  const DistanceField a(open_tile_source(directory_ / "a.gdfmap"));
  const DistanceField b(open_tile_source(directory_ / "b.gdfmap"));
  EXPECT_NEAR(b.at({0.1, 0.2, 0.3}).distance, a.at({0.1, 0.2, 0.3}).distance, 1e-5);
}

TEST_F(ModelExchangeTest, ImportRefusesAnExistingMap) {
  export_model(map_, directory_ / "a.bin");
  EXPECT_THROW(import_model(directory_ / "a.bin", directory_ / "a.gdfmap"), Error);
}

TEST_F(ModelExchangeTest, ARegionSelectsTheCubesThatMeetIt) {
  const ExportReport all = export_model(map_, directory_ / "all.bin");
  const Box3 region(Vector3(-10, -10, -10), Vector3(0.5, 10, 10));
  const ExportReport part = export_model(map_, directory_ / "part.bin", region);
  EXPECT_GT(part.num_cubes, 0u);
  EXPECT_LT(part.num_cubes, all.num_cubes);
  for (const Gdf1Cube& cube : read_model(directory_ / "part.bin").cubes) EXPECT_LE(cube.key.x, 0);
  EXPECT_THROW(export_model(map_, directory_ / "none.bin",
                            Box3(Vector3(100, 100, 100), Vector3(101, 101, 101))),
               Error);
  EXPECT_FALSE(std::filesystem::exists(directory_ / "none.bin"));
}

TEST_F(ModelExchangeTest, RefusesAnUnknownExtensionBeforeAnyWork) {
  EXPECT_THROW(export_model(map_, directory_ / "a.xyz"), Error);
}

TEST(ModelExchange, RefusesAnExtentThatFloat32CannotCarryAndNamesTheRemedy) {
  const test::TemporaryDirectory directory;
  Map map = test::map_of(directory / "a.gdfmap", {{{0.5, 0.5, 0.5}, {1e7, 0.5, 0.5}}});
  train(map, quick_options());
  try {
    export_model(map, directory / "a.bin");
    FAIL() << "exported an extent of 10,000 km";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kUsage);
    EXPECT_NE(std::string(error.what()).find("--region"), std::string::npos);
  }
  EXPECT_FALSE(std::filesystem::exists(directory / "a.bin"));
}

TEST(ModelExchange, ShiftsLargeCoordinatesAndShiftsThemBack) {
  const test::TemporaryDirectory directory;
  const Vector3 place(637291.5, 851210.5, 511.5);
  Map map = test::map_of(directory / "a.gdfmap", {{place}});
  train(map, quick_options());
  const ExportReport report = export_model(map, directory / "a.bin");
  EXPECT_GT(report.shift.norm(), 0.0);
  const DistanceField of_map(open_tile_source(directory / "a.gdfmap"));
  const DistanceField of_bin(open_tile_source(directory / "a.bin"));
  const Vector3 p = place + Vector3(0.3, 0.2, 0.1);
  ASSERT_EQ(of_map.at(p).status, FieldStatus::kFine);
  EXPECT_NEAR(of_bin.at(p).distance, of_map.at(p).distance, 1e-4);
}

}  // namespace
}  // namespace gdfmap
