#include <algorithm>
#include <array>
#include <utility>

#include <gtest/gtest.h>

#include "tiling_fixtures.hpp"

namespace gdfmap {
namespace {

using VoxelThinningTest = TilingTest;

struct Voxel {
  TileKey tile;
  std::array<std::int64_t, 6> cube_and_voxel;
  auto operator<=>(const Voxel&) const = default;
};
struct Candidate {
  std::int64_t distance;
  std::uint64_t code;
  TileOffset point;
  auto operator<=>(const Candidate&) const = default;
};

/// The points that are left, by the definition alone: one of every voxel, nearest to its centre,
/// then first in Morton order.
std::map<TileKey, std::vector<TileOffset>> thinned_by_definition(const std::vector<Vector3>& cloud,
                                                                 int steps) {
  std::vector<std::pair<Voxel, Candidate>> candidates;
  for (const Vector3& p_world : cloud) {
    const LatticePoint p = *kLattice.quantize(p_world);
    const TileKey tile = tile_of(p);
    const LatticePoint origin = tile_origin(tile);
    const std::int64_t xyz[3] = {p.x - origin.x, p.y - origin.y, p.z - origin.z};
    Voxel voxel{tile, {}};
    std::int64_t distance = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      voxel.cube_and_voxel[a] = xyz[axis] / kStepsPerCubeAxis;
      const std::int64_t in_cube = xyz[axis] % kStepsPerCubeAxis;
      voxel.cube_and_voxel[a + 3] = in_cube / steps;
      const std::int64_t off = 2 * in_cube - (2 * (in_cube / steps) + 1) * steps;
      distance += off * off;
    }
    std::uint64_t code = 0;
    for (int bit = 0; bit < 16; ++bit) {
      for (int axis = 0; axis < 3; ++axis) {
        code |= static_cast<std::uint64_t>(xyz[axis] >> bit & 1) << (3 * bit + axis);
      }
    }
    const Candidate candidate{
        distance,
        code,
        {static_cast<std::uint16_t>(xyz[0]), static_cast<std::uint16_t>(xyz[1]),
         static_cast<std::uint16_t>(xyz[2])}};
    candidates.emplace_back(voxel, candidate);
  }
  std::sort(candidates.begin(), candidates.end());
  std::map<TileKey, std::vector<TileOffset>> tiles;
  const Voxel* last = nullptr;
  for (const auto& [voxel, candidate] : candidates) {
    if (last == nullptr || *last != voxel) tiles[voxel.tile].push_back(candidate.point);
    last = &voxel;
  }
  sort_points(tiles);
  return tiles;
}

IngestOptions voxels_of(double size) {
  IngestOptions options;
  options.voxel_size = size;
  return options;
}

std::vector<Vector3> joined(std::vector<Vector3> a, const std::vector<Vector3>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST_F(VoxelThinningTest, KeepsTheNearestToTheCentreOfEveryVoxel) {
  const std::vector<Vector3> points = wavy_surface(150'000, 1, 12.0);
  for (const double size : {0.05, 0.3, 1.0}) {  // 0.3 m does not divide a cube
    PointStore store = create(std::to_string(size));
    const IngestReport report = ingest(points, store, voxels_of(size));
    const int steps = static_cast<int>(std::lround(size / kLattice.step()));
    EXPECT_EQ(report.source.voxel_steps, steps);
    EXPECT_EQ(content_of(store).points, thinned_by_definition(points, steps)) << size;
    const IngestCounts& counts = report.source.counts;
    EXPECT_EQ(counts.num_read, counts.num_stored + counts.num_duplicates + counts.num_thinned);
    EXPECT_GT(counts.num_thinned, 0u);
    EXPECT_TRUE(store.verify(true).empty());
  }
}

TEST_F(VoxelThinningTest, InOneGoIsTheSameAsInTwoInAnyOrderAndAnyDivision) {
  const std::vector<Vector3> a = wavy_surface(60'000, 2, 8.0), b = wavy_surface(60'000, 3, 8.0);
  PointStore whole = create("whole"), ab = create("ab"), ba = create("ba");
  ingest(joined(a, b), whole, voxels_of(0.1));
  ingest(a, ab, voxels_of(0.1));
  ingest(b, ab, voxels_of(0.1));
  ingest(b, ba, voxels_of(0.1));
  ingest(a, ba, voxels_of(0.1));
  EXPECT_EQ(content_of(ab).points, content_of(whole).points);
  EXPECT_EQ(content_of(ab).cubes, content_of(whole).cubes);
  EXPECT_EQ(content_of(ab), content_of(ba));
}

TEST_F(VoxelThinningTest, SourcesOfOtherSizesAndThoseThatKeepAllAreNotTouched) {
  const std::vector<Vector3> a = wavy_surface(20'000, 4, 8.0), b = wavy_surface(20'000, 5, 8.0);
  const std::vector<Vector3> c = wavy_surface(20'000, 6, 8.0);
  PointStore store = create();
  ingest(a, store, voxels_of(0.1));
  ingest(b, store, voxels_of(0.25));
  ingest(c, store);
  auto expected = thinned_by_definition(a, 819);
  for (const auto& other : {thinned_by_definition(b, 2048), thinned_by_definition(c, 1)}) {
    for (const auto& [tile, points] : other) {
      expected[tile].insert(expected[tile].end(), points.begin(), points.end());
    }
  }
  sort_points(expected);
  EXPECT_EQ(content_of(store).points, expected);
}

TEST_F(VoxelThinningTest, RemovingASourceBringsBackWhatItsPointsHadDisplaced) {
  const std::vector<Vector3> a = wavy_surface(30'000, 7, 8.0), b = wavy_surface(30'000, 8, 8.0);
  PointStore alone = create("alone"), both = create("both");
  ingest(a, alone, voxels_of(0.2));
  ingest(a, both, voxels_of(0.2));
  const IngestReport second = ingest(b, both, voxels_of(0.2));
  EXPECT_NE(content_of(both), content_of(alone));
  both.remove(second.source.id);
  EXPECT_EQ(content_of(both), content_of(alone));
}

TEST_F(VoxelThinningTest, ATileOfMoreThanAMillionThinnedPointsIsTheSame) {
  // Nine blocks of each of two sources in one tile: too many to thin in one piece.
  const std::vector<Vector3> a = wavy_surface(550'000, 9, 7.9), b = wavy_surface(550'000, 10, 7.9);
  PointStore store = create();
  std::vector<Vector3> in_one_tile = joined(a, b);
  for (Vector3& p : in_one_tile) p += Vector3(4, 4, 4);
  const auto middle = in_one_tile.begin() + 550'000;
  ingest({in_one_tile.begin(), middle}, store, voxels_of(0.002));
  ingest({middle, in_one_tile.end()}, store, voxels_of(0.002));
  ASSERT_EQ(store.totals().num_tiles, 1u);
  ASSERT_GT(store.totals().num_points, std::uint64_t{1} << 20);
  EXPECT_EQ(content_of(store).points, thinned_by_definition(in_one_tile, 16));
}

TEST_F(VoxelThinningTest, VoxelSizeIsPartOfTheIdentityAndOfTheDigest) {
  const std::vector<Vector3> points = wavy_surface(5000, 11);
  PointStore store = create(), other = create("other");
  ingest(points, store);
  EXPECT_FALSE(ingest(points, store, voxels_of(0.1)).already_present);
  EXPECT_TRUE(ingest(points, store, voxels_of(0.1)).already_present);
  ingest(points, other, voxels_of(0.1));
  ingest(points, other, voxels_of(0.2));
  EXPECT_NE(content_of(store).digests, content_of(other).digests);
}

TEST_F(VoxelThinningTest, SizesThatMakeNoSenseAreRefused) {
  PointStore store = create();
  for (const double size : {-0.1, 1e-5, 1.01, std::nan("")}) {
    const Error error = error_of([&] { ingest({{1, 1, 1}}, store, voxels_of(size)); });
    EXPECT_EQ(error.code(), ErrorCode::kUsage) << size;
    EXPECT_NE(std::string(error.what()).find("voxel"), std::string::npos);
  }
}

}  // namespace
}  // namespace gdfmap
