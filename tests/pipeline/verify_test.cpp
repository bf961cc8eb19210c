#include <gtest/gtest.h>

#include <gdfmap/pipeline/verify.hpp>
#include <gdfmap/train/train.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

TEST(Verify, ASoundMapHasNoFaults) {
  const test::TemporaryDirectory directory;
  Map map = test::map_of(directory / "a.gdfmap", {{{0.5, 0.5, 0.5}}});
  train(map);
  for (const bool quick : {true, false}) {
    const VerifyReport report = verify(map, quick);
    EXPECT_TRUE(report.faults.empty()) << report.faults.front();
    EXPECT_EQ(report.content_digest, map.cubes().content_digest());
  }
}

TEST(Verify, NamesADamagedTileAndADamagedBlock) {
  const test::TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  {
    Map map = test::map_of(path, {{{0.5, 0.5, 0.5}}});
    train(map);
  }
  db::Database(path / "cubes.db", db::OpenMode::kWrite)
      .execute("UPDATE tile_blobs SET data = zeroblob(length(data))");
  db::Database(path / "points.db", db::OpenMode::kWrite)
      .execute("UPDATE blocks SET data = zeroblob(length(data))");
  Map map = Map::open(path, Access::kRead);
  const VerifyReport report = verify(map, false);
  ASSERT_GE(report.faults.size(), 2u);
  std::string all;
  for (const std::string& fault : report.faults) all += fault + "\n";
  EXPECT_NE(all.find("tile"), std::string::npos) << all;
  EXPECT_NE(all.find("a.gdfmap.ply"), std::string::npos) << all;
}

}  // namespace
}  // namespace gdfmap
