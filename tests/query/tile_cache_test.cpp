#include <atomic>
#include <functional>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/query/tile_cache.hpp>

#include "field_builder.hpp"

namespace gdfmap {
namespace {

/// Tiles with x ≥ 0 are there, all of one size; those with x = −1 are absent, below that they fail.
class CountingSource : public TileSource {
 public:
  CountingSource() : TileSource({}) {}

  std::optional<TileRecord> load(const TileKey& key) override {
    ++num_loads;
    if (while_loading) while_loading();
    if (key.x == -1) return std::nullopt;
    if (key.x == -2) throw Error(ErrorCode::kCorrupt, "damaged");
    if (key.x == -3) throw Error(ErrorCode::kIo, "unplugged");
    if (key.x == -4) throw std::runtime_error("defect");
    std::mt19937 random(1);
    test::FieldBuilder builder({});
    builder.add(cube_at(key, 0), test::random_gaussians(1000, 1.0, random));
    return builder.tiles()[0];
  }
  std::optional<TileVersion> version(const TileKey&) override {
    return TileVersion{{static_cast<std::uint64_t>(state.load()), 0}, {}, {}};
  }
  std::vector<OccupiedTile> occupied() override { return {}; }
  bool has_cubes() override { return true; }

  std::atomic<int> num_loads = 0;
  std::atomic<int> state = 0;  ///< of all tiles
  std::function<void()> while_loading;
};

TileKey tile(int x) { return {0, x, 0, 0}; }

class TileCacheTest : public ::testing::Test {
 protected:
  std::size_t bytes_of_one() {
    TileCache cache(source, 1 << 30);
    static_cast<void>(cache.get(tile(0)));
    return cache.statistics().num_bytes;
  }
  std::shared_ptr<CountingSource> source = std::make_shared<CountingSource>();
};

TEST_F(TileCacheTest, LoadsATileOnce) {
  TileCache cache(source, 1 << 30);
  const CachedTile first = cache.get(tile(1));
  const CachedTile second = cache.get(tile(1));
  EXPECT_EQ(first.availability, TileAvailability::kLoaded);
  EXPECT_EQ(first.tile, second.tile);
  const TileCacheStatistics statistics = cache.statistics();
  EXPECT_EQ(statistics.hits, 1u);
  EXPECT_EQ(statistics.misses, 1u);
  EXPECT_EQ(statistics.loads, 1u);
  EXPECT_EQ(statistics.num_tiles, 1u);
  EXPECT_GT(statistics.num_bytes, 28000u);
}

TEST_F(TileCacheTest, RemembersAbsentTiles) {
  TileCache cache(source, 1 << 30);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(cache.get(tile(-1)).availability, TileAvailability::kAbsent);
  }
  EXPECT_EQ(source->num_loads, 1);
  EXPECT_EQ(cache.statistics().unreadable, 0u);
}

TEST_F(TileCacheTest, RemembersAndCountsUnreadableTiles) {
  TileCache cache(source, 1 << 30);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(cache.get(tile(-2)).availability, TileAvailability::kUnreadable);
    EXPECT_EQ(cache.get(tile(-3)).availability, TileAvailability::kUnreadable);
  }
  EXPECT_EQ(source->num_loads, 2);
  EXPECT_EQ(cache.statistics().unreadable, 2u);
  EXPECT_FALSE(cache.statistics().first_error.empty());
}

TEST_F(TileCacheTest, PassesOnADefectAndTriesAgain) {
  TileCache cache(source, 1 << 30);
  EXPECT_THROW(static_cast<void>(cache.get(tile(-4))), std::runtime_error);
  EXPECT_THROW(static_cast<void>(cache.get(tile(-4))), std::runtime_error);
  EXPECT_EQ(source->num_loads, 2);
}

TEST_F(TileCacheTest, NeverHoldsMoreThanItsBytes) {
  const std::size_t one = bytes_of_one();
  const std::size_t budget = 5 * one + one / 2;
  TileCache cache(source, budget);
  for (int i = 0; i < 200; ++i) {
    static_cast<void>(cache.get(tile(i)));
    EXPECT_LE(cache.statistics().num_bytes, budget);
  }
  const TileCacheStatistics statistics = cache.statistics();
  EXPECT_EQ(statistics.num_tiles, 5u);
  EXPECT_EQ(statistics.evictions, 195u);
}

TEST_F(TileCacheTest, NegativeEntriesCountAndAreBounded) {
  TileCache cache(source, 10'000);
  for (int i = 0; i < 1000; ++i) static_cast<void>(cache.get({0, -1, i, 0}));
  EXPECT_LE(cache.statistics().num_bytes, 10'000u);
  EXPECT_GT(cache.statistics().evictions, 900u);
}

TEST_F(TileCacheTest, KeepsTheNewestTile) {
  const std::size_t one = bytes_of_one();
  TileCache cache(source, one + one / 2);
  for (int i = 0; i < 50; ++i) {
    static_cast<void>(cache.get(tile(i)));
    static_cast<void>(cache.get(tile(i)));
  }
  EXPECT_EQ(cache.statistics().hits, 50u);
}

TEST_F(TileCacheTest, ServesEvenWhenItCannotHoldOneTile) {
  TileCache cache(source, 0);
  const CachedTile held = cache.get(tile(0));
  for (int i = 1; i < 20; ++i) {
    EXPECT_EQ(cache.get(tile(i)).availability, TileAvailability::kLoaded);
  }
  EXPECT_EQ(cache.statistics().num_tiles, 0u);
  EXPECT_EQ(cache.statistics().num_bytes, 0u);
  EXPECT_EQ(held.tile->num_cubes(), 1u);  // evicted, and alive while held
}

TEST_F(TileCacheTest, ThreadsThatAskTogetherLoadOnce) {
  for (const std::size_t budget : {std::size_t{1} << 30, std::size_t{0}}) {
    TileCache cache(source, budget);
    source->num_loads = 0;
    source->while_loading = [&] {  // until all six have asked
      while (cache.statistics().misses < 6) std::this_thread::yield();
    };
    std::vector<CachedTile> tiles(6);
    std::vector<std::thread> threads;
    for (CachedTile& result : tiles) {
      threads.emplace_back([&] { result = cache.get(tile(7)); });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(source->num_loads, 1);
    for (const CachedTile& result : tiles) EXPECT_EQ(result.tile, tiles[0].tile);
  }
}

TEST_F(TileCacheTest, SurvivesManyThreadsUnderPressure) {
  const std::size_t budget = 3 * bytes_of_one();
  TileCache cache(source, budget);
  std::atomic<int> num_wrong = 0;
  std::vector<std::thread> threads;
  for (unsigned seed = 0; seed < 4; ++seed) {
    threads.emplace_back([&, seed] {
      std::mt19937 random(seed);
      for (int i = 0; i < 500; ++i) {
        const int x = static_cast<int>(random() % 15) - 3;
        const TileAvailability expected = x >= 0    ? TileAvailability::kLoaded
                                          : x == -1 ? TileAvailability::kAbsent
                                                    : TileAvailability::kUnreadable;
        num_wrong += cache.get(tile(x)).availability != expected;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(num_wrong, 0);
  const TileCacheStatistics statistics = cache.statistics();
  EXPECT_LE(statistics.num_bytes, budget);
  EXPECT_EQ(statistics.hits + statistics.misses, 2000u);
  EXPECT_EQ(statistics.loads, static_cast<std::uint64_t>(source->num_loads) - 1);  // bytes_of_one
}

TEST_F(TileCacheTest, FindsOnlyWhatIsInMemory) {
  TileCache cache(source, 1 << 30);
  EXPECT_EQ(cache.find(tile(1)).availability, TileAvailability::kPending);
  EXPECT_EQ(source->num_loads, 0);
  const CachedTile loaded = cache.get(tile(1));
  EXPECT_EQ(cache.find(tile(1)).tile, loaded.tile);
  EXPECT_DOUBLE_EQ(cache.statistics().hit_rate(), 1.0 / 3.0);
}

TEST_F(TileCacheTest, HasNoHitRateBeforeTheFirstLookUp) {
  EXPECT_EQ(TileCache(source, 1 << 30).statistics().hit_rate(), 0.0);
}

TEST_F(TileCacheTest, RefreshDropsWhatChangedAndWhatWasUnreadable) {
  TileCache cache(source, 1 << 30);
  for (const int x : {1, 2, -1, -2}) static_cast<void>(cache.get(tile(x)));
  EXPECT_EQ(cache.refresh(), 1u);  // the unreadable one
  source->state = 1;
  EXPECT_EQ(cache.refresh(), 3u);
  EXPECT_EQ(cache.statistics().num_tiles, 0u);
  EXPECT_EQ(cache.statistics().num_bytes, 0u);
  static_cast<void>(cache.get(tile(1)));
  EXPECT_EQ(cache.refresh(), 0u);
}

TEST_F(TileCacheTest, ALoadThatARefreshOvertookIsNotKept) {
  TileCache cache(source, 1 << 30);
  source->while_loading = [&] {
    if (source->num_loads > 1) return;
    source->state = 1;
    cache.refresh();
  };
  EXPECT_EQ(cache.get(tile(1)).availability, TileAvailability::kLoaded);
  EXPECT_EQ(cache.statistics().num_tiles, 0u);
  static_cast<void>(cache.get(tile(1)));
  EXPECT_EQ(source->num_loads, 2);
}

TEST_F(TileCacheTest, NobodyWaitsForALoadThatARefreshOvertook) {
  TileCache cache(source, 1 << 30);
  CachedTile after;
  source->while_loading = [&] {
    if (source->num_loads > 1) return;
    source->state = 1;
    cache.refresh();
    after = cache.get(tile(1));  // the load that is under way began before
  };
  const CachedTile before = cache.get(tile(1));
  EXPECT_EQ(source->num_loads, 2);
  EXPECT_NE(before.tile, after.tile);
  EXPECT_EQ(cache.get(tile(1)).tile, after.tile);
}

}  // namespace
}  // namespace gdfmap
