#include <atomic>
#include <cmath>
#include <filesystem>
#include <thread>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/query/tile_source.hpp>
#include <gdfmap/store/tile_codec.hpp>

#include "field_builder.hpp"

namespace gdfmap {
namespace {

using test::constant_gaussians;
using test::FieldBuilder;

Gdf1Cube model_cube(const CubeKey& key, float value) {
  return {key, 0.3f, 0.4f, constant_gaussians(value)};
}

template <typename Action>
ErrorCode code_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.code();
  }
  ADD_FAILURE() << "nothing was thrown";
  return ErrorCode::kInternal;
}

TEST(TileSource, PutsTheCubesOfAModelIntoTiles) {
  const Gdf1Cube cubes[] = {model_cube({0, 7, 0, 0}, 1.0f), model_cube({0, -1, 0, 0}, 2.0f),
                            model_cube({0, 0, 0, 0}, 3.0f)};
  const std::vector<TileRecord> tiles = tiles_of_model(cubes);
  ASSERT_EQ(tiles.size(), 2u);
  EXPECT_EQ(tiles[0].key, (TileKey{0, -1, 0, 0}));
  ASSERT_EQ(tiles[0].cubes.size(), 1u);
  EXPECT_EQ(tiles[0].cubes[0].index, 7);
  ASSERT_EQ(tiles[1].cubes.size(), 2u);
  EXPECT_EQ(tiles[1].cubes[0].gaussians, constant_gaussians(3.0f));
  const CubeRecord& cube = tiles[1].cubes[1];
  EXPECT_EQ(cube.index, 7);
  EXPECT_EQ(cube.status, CubeStatus::kFitted);
  EXPECT_EQ(cube.cube_class, CubeClass::kUnknown);
  EXPECT_EQ(cube.errors.mae, 0.3f);
  EXPECT_NEAR(cube.errors.rmse, 0.5f, 1e-6);
  EXPECT_TRUE(std::isnan(cube.errors.p95));
  EXPECT_TRUE(std::isnan(cube.errors.max));
  EXPECT_FALSE(encode_tile(tiles[1]).empty());  // can be stored
}

TEST(TileSource, TakesEveryCubeOfAModelForOccupied) {
  Model model;
  model.header.cube_size = 0.5;
  model.header.margin = 0.1;
  model.cubes = {model_cube({0, 0, 0, 0}, 1.0f), model_cube({0, 9, 0, 0}, 1.0f)};
  const std::shared_ptr<TileSource> source = model_tile_source(model);
  EXPECT_EQ(source->geometry(), (Geometry{0.5, 0.1, 1}));
  EXPECT_TRUE(source->has_cubes());
  const std::vector<OccupiedTile> occupied = source->occupied();
  ASSERT_EQ(occupied.size(), 2u);
  EXPECT_EQ(occupied[1].key, (TileKey{0, 1, 0, 0}));
  EXPECT_TRUE(occupied[1].cubes.test(1));
  EXPECT_EQ(occupied[1].cubes.count(), 1);
}

TEST(TileSource, RefusesACubeThatIsThereTwiceOrOfAnotherLevel) {
  const Gdf1Cube twice[] = {model_cube({0, 1, 0, 0}, 1.0f), model_cube({0, 1, 0, 0}, 2.0f)};
  EXPECT_EQ(code_of([&] { static_cast<void>(tiles_of_model(twice)); }), ErrorCode::kUsage);
  const Gdf1Cube coarse[] = {model_cube({1, 1, 0, 0}, 1.0f)};
  EXPECT_EQ(code_of([&] { static_cast<void>(tiles_of_model(coarse)); }), ErrorCode::kUsage);
  std::vector<TileRecord> tiles(2);
  EXPECT_EQ(code_of([&] { MemoryTileSource({}, tiles, {}); }), ErrorCode::kUsage);
}

TEST(TileSource, AStoreServesManyThreadsAtOnce) {
  const auto directory = std::filesystem::path(::testing::TempDir()) / "tile_source_threads";
  std::filesystem::remove_all(directory);
  std::filesystem::create_directories(directory);
  const FieldBuilder builder = test::random_block(2, 0.2, 9);
  const std::vector<TileRecord> tiles = builder.tiles();
  CubeStore(directory / "cubes.db", db::OpenMode::kCreate).put(tiles);
  StoreTileSource source(directory / "cubes.db", builder.geometry());
  EXPECT_TRUE(source.has_cubes());
  EXPECT_TRUE(source.occupied().empty());
  std::atomic<int> num_equal = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (const TileRecord& tile : tiles) {
        const std::optional<TileRecord> loaded = source.load(tile.key);
        num_equal += loaded && encode_tile(*loaded) == encode_tile(tile);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(num_equal, 4 * static_cast<int>(tiles.size()));
  EXPECT_FALSE(source.load({0, 99, 0, 0}).has_value());
  std::filesystem::remove_all(directory);
}

TEST(TileSource, AMissingStoreIsAnInputError) {
  const auto path = std::filesystem::path(::testing::TempDir()) / "no_such_map" / "cubes.db";
  EXPECT_EQ(code_of([&] { StoreTileSource(path, {}); }), ErrorCode::kIo);
}

}  // namespace
}  // namespace gdfmap
