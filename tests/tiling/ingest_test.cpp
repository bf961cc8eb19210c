#include <cmath>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>

#include <gdfmap/tiling/ingest.hpp>

#include "tiling_fixtures.hpp"

namespace gdfmap {
namespace {

using IngestTest = TilingTest;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

class RecordingSink : public ReportSink {
 public:
  void on_progress(const Progress& progress) override { last_progress = progress; }
  void on_message(Severity severity, const std::string& message) override {
    if (severity == Severity::kWarning) warnings.push_back(message);
  }
  Progress last_progress;
  std::vector<std::string> warnings;
};

/// The points that a store must hold, by the lattice alone.
std::map<TileKey, std::vector<TileOffset>> expected_points(const std::vector<Vector3>& points) {
  std::map<TileKey, std::vector<TileOffset>> expected;
  for (const Vector3& p_world : points) {
    const LatticePoint p = *kLattice.quantize(p_world);
    const TileKey tile = tile_of(p);
    const LatticePoint origin = tile_origin(tile);
    expected[tile].push_back({static_cast<std::uint16_t>(p.x - origin.x),
                              static_cast<std::uint16_t>(p.y - origin.y),
                              static_cast<std::uint16_t>(p.z - origin.z)});
  }
  sort_points(expected);
  return expected;
}

TEST_F(IngestTest, StoresEveryPointOfTheCloudOnTheLattice) {
  PointStore store = create();
  const std::vector<Vector3> points = wavy_surface(200'000, 1);
  const IngestReport report = ingest(points, store);
  EXPECT_EQ(content_of(store).points, expected_points(points));
  EXPECT_FALSE(report.already_present);
  EXPECT_EQ(report.source.id, 1);
  const IngestCounts& counts = report.source.counts;
  EXPECT_EQ(counts.num_read, points.size());
  EXPECT_EQ(counts.num_read, counts.num_stored + counts.num_duplicates);
  EXPECT_EQ(store.sources().front().counts, counts);
  EXPECT_EQ(store.totals().num_points, counts.num_stored);
  EXPECT_TRUE(store.verify(true).empty());
}

TEST_F(IngestTest, KeepsARealCloudWithinHalfAStep) {
  const std::string path = GDFMAP_SHARED_DATA "/hancock_room_crop.ply";
  std::ifstream file(path, std::ios::binary);
  if (!file) GTEST_SKIP() << path << " is not there";
  for (std::string line; line != "end_header";) std::getline(file, line);
  std::vector<Vector3> points;
  for (std::array<char, 15> vertex; file.read(vertex.data(), vertex.size());) {
    float xyz[3];  // little-endian, as every machine that runs these tests
    std::memcpy(xyz, vertex.data(), sizeof(xyz));
    points.emplace_back(xyz[0], xyz[1], xyz[2]);
  }
  PointStore store = create();
  const IngestReport report = ingest(points, store);
  EXPECT_EQ(report.source.counts.num_read, 779'346u);
  EXPECT_EQ(content_of(store).points, expected_points(points));
  EXPECT_LT(store.totals().block_bytes, 5 * report.source.counts.num_stored);
}

TEST_F(IngestTest, CubesAreThoseThatHoldPoints) {
  PointStore store = create();
  ingest(wavy_surface(20'000, 2), store);
  store.for_each_tile([&](const TilePoints& tile) {
    CubeMask cubes;
    store.for_each_block(tile.key, [&](std::span<const TileOffset> points) {
      for (const TileOffset& p : points) cubes.set(p.cube());
    });
    EXPECT_EQ(tile.cubes, cubes);
  });
}

TEST_F(IngestTest, DigestsDependOnNeitherOrderNorDivision) {
  std::vector<Vector3> points = wavy_surface(150'000, 3, 6.0);  // few tiles, several blocks each
  PointStore first = create("first");
  ingest(points, first);
  std::shuffle(points.begin(), points.end(), std::mt19937(4));
  PointStore second = create("second");
  MemoryReader reader(points, 77);
  static_cast<void>(ingest_points(reader, "shuffled", kLattice, second, {}, {}));
  EXPECT_EQ(content_of(first), content_of(second));
}

TEST_F(IngestTest, TheDigestOfATileFollowsFromItsPoints) {
  PointStore store = create();
  ingest({{1.0, 2.0, 3.0}, {1.0, 2.0, 3.0}}, store);  // a duplicate counts in the digest
  const std::int64_t xyz[3] = {8192, 16384, 24576};
  const Digest once = hash128(std::as_bytes(std::span(xyz)));
  Digest points = once;
  points += once;
  ByteWriter writer;
  writer.put(points);
  writer.put(std::int64_t{0});
  EXPECT_EQ(store.find_tile({0, 0, 0, 0})->digest, hash128(writer.bytes()));
}

TEST_F(IngestTest, EachPointChangesTheDigest) {
  std::vector<Vector3> points = wavy_surface(1000, 5, 4.0);
  PointStore first = create("first");
  ingest(points, first);
  points[500].x() += kLattice.step();
  PointStore second = create("second");
  ingest(points, second);
  EXPECT_NE(content_of(first).digests, content_of(second).digests);
}

TEST_F(IngestTest, SourcesAreAUnionWhateverTheirOrder) {
  const std::vector<Vector3> a = wavy_surface(30'000, 6), b = wavy_surface(30'000, 7);
  PointStore first = create("first"), second = create("second"), alone = create("alone");
  ingest(a, first);
  const IngestReport second_of_first = ingest(b, first);
  ingest(b, second);
  ingest(a, second);
  EXPECT_EQ(content_of(first), content_of(second));
  ingest(a, alone);
  EXPECT_NE(content_of(first), content_of(alone));
  first.remove(second_of_first.source.id);
  EXPECT_EQ(content_of(first), content_of(alone));
}

TEST_F(IngestTest, CountsRejectedPointsByReason) {
  PointStore store = create();
  const std::vector<Vector3> points{{1, 1, 1},    {kNan, 0, 0},   {0, kInfinity, 0},
                                    {0, 0, 0},    {0, -0.0, 0},   {1, 1, 1},
                                    {1e12, 0, 0}, {-1e300, 0, 0}, {5, 5, 5}};
  IngestOptions options;
  options.drop_zero = true;
  const IngestReport report = ingest(points, store, options);
  EXPECT_EQ(report.source.counts, (IngestCounts{.num_read = 9,
                                                .num_stored = 2,
                                                .num_duplicates = 1,
                                                .num_thinned = 0,
                                                .num_rejected_not_finite = 2,
                                                .num_rejected_withheld = 0,
                                                .num_rejected_zero = 2,
                                                .num_rejected_out_of_range = 2,
                                                .num_rejected_outside = 0}));
  EXPECT_EQ(report.num_zero, 2u);
}

TEST_F(IngestTest, AnOutlierFarAwayCostsOneTile) {
  PointStore store = create();
  ingest({{1, 1, 1}, {1e7, -1e7, 1e7}}, store);
  EXPECT_EQ(store.totals().num_tiles, 2u);
}

TEST_F(IngestTest, WithheldPointsAreCounted) {
  class WithholdingReader : public MemoryReader {
   public:
    using MemoryReader::MemoryReader;
    [[nodiscard]] std::uint64_t num_withheld() const override { return 3; }
  };
  PointStore store = create();
  WithholdingReader reader({{1, 1, 1}});
  const auto counts = ingest_points(reader, "las", kLattice, store, {}, {}).source.counts;
  EXPECT_EQ(counts.num_rejected_withheld, 3u);
  EXPECT_EQ(counts.num_read, 4u);
}

TEST_F(IngestTest, ManyZerosAreWarnedOfUnlessDropped) {
  std::vector<Vector3> points = wavy_surface(980, 8);
  points.insert(points.end(), 20, Vector3::Zero());
  RecordingSink sink;
  const RunContext context{.sink = &sink};
  PointStore store = create();
  EXPECT_EQ(ingest(points, store, {}, context).num_zero, 20u);
  ASSERT_EQ(sink.warnings.size(), 1u);
  EXPECT_NE(sink.warnings[0].find("--drop-zero"), std::string::npos);
  EXPECT_NE(sink.warnings[0].find("2.0 %"), std::string::npos) << sink.warnings[0];
  IngestOptions options;
  options.drop_zero = true;
  ingest(points, store, options, context);
  points.resize(985);
  ingest(points, store, {}, context);
  EXPECT_EQ(sink.warnings.size(), 1u);
}

TEST_F(IngestTest, ScalesFirstAndThenTransforms) {
  PointStore store = create();
  IngestOptions options;
  options.transform.scale = 0.5;
  options.transform.T_map_source = Eigen::Translation3d(10, 20, 30) *
                                   Eigen::AngleAxisd(std::acos(-1.0) / 2, Eigen::Vector3d::UnitZ());
  ingest({{2, 4, 6}}, store, options);
  // (2, 4, 6) · 0.5 = (1, 2, 3), turned to (-2, 1, 3), moved to (8, 21, 33).
  EXPECT_EQ(content_of(store).points, expected_points({{8, 21, 33}}));
}

TEST_F(IngestTest, UnusableOptionsAreRefusedBeforeAnythingIsWritten) {
  PointStore store = create();
  IngestOptions options;
  for (const double scale : {0.0, -1.0, kNan, kInfinity}) {
    options.transform.scale = scale;
    EXPECT_EQ(error_of([&] { ingest({{1, 1, 1}}, store, options); }).code(), ErrorCode::kUsage);
  }
  options = {};
  options.transform.T_map_source.translation().x() = kNan;
  EXPECT_EQ(error_of([&] { ingest({{1, 1, 1}}, store, options); }).code(), ErrorCode::kUsage);
  const RunContext context{.memory_bytes = kMinMemoryBytes - 1};
  EXPECT_EQ(error_of([&] { ingest({{1, 1, 1}}, store, {}, context); }).code(), ErrorCode::kUsage);
}

TEST_F(IngestTest, CanonicalTextTellsOptionsApartAndNothingElse) {
  IngestOptions options;
  EXPECT_EQ(options.canonical(), "scale=1 transform=1,0,0,0,0,1,0,0,0,0,1,0 drop_zero=0");
  options.transform.T_map_source(0, 3) = -0.0;
  EXPECT_EQ(options.canonical(), IngestOptions{}.canonical());
  options.transform.scale = 0.1 + 0.2;
  EXPECT_NE(options.canonical().find("0.30000000000000004"), std::string::npos);
  options.drop_zero = true;
  EXPECT_NE(options.canonical().find("drop_zero=1"), std::string::npos);
}

TEST_F(IngestTest, TheSameSourceAgainChangesNothing) {
  PointStore store = create();
  const std::vector<Vector3> points = wavy_surface(5000, 9);
  const IngestReport first = ingest(points, store);
  const Content before = content_of(store);
  const IngestReport again = ingest(points, store);
  EXPECT_TRUE(again.already_present);
  EXPECT_EQ(again.source.id, first.source.id);
  EXPECT_EQ(again.source.counts, first.source.counts);
  EXPECT_EQ(content_of(store), before);
  IngestOptions options;
  options.transform.scale = 2.0;  // the same bytes otherwise are another source
  EXPECT_FALSE(ingest(points, store, options).already_present);
  EXPECT_EQ(store.sources().size(), 2u);
}

/// Its identity is that of the bytes of a file; reading counts.
class FileReader : public MemoryReader {
 public:
  explicit FileReader(const std::filesystem::path& path) : MemoryReader({{1, 2, 3}}) {
    std::ifstream file(path, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(file), {});
  }
  [[nodiscard]] std::size_t read(std::span<Vector3> points) override {
    ++num_reads;
    return MemoryReader::read(points);
  }
  [[nodiscard]] Digest identity() override { return hash128(std::as_bytes(std::span(bytes_))); }
  [[nodiscard]] std::uint64_t num_bytes() const override { return bytes_.size(); }
  int num_reads = 0;

 private:
  std::string bytes_;
};

TEST_F(IngestTest, AKnownFileIsRecognisedWithoutBeingStagedAgain) {
  const std::string big(3'000'000, 'a');
  std::ofstream(path("a.xyz")) << big;
  std::ofstream(path("copy.xyz")) << big;
  std::ofstream(path("same_size.xyz")) << std::string(big.size(), 'b');
  PointStore store = create();
  const auto ingest_file = [&](const char* name, int& num_reads) {
    FileReader reader(path(name));
    const auto report = ingest_points(reader, path(name).string(), kLattice, store, {}, {});
    num_reads = reader.num_reads;
    return report.already_present;
  };
  int num_reads = 0;
  EXPECT_FALSE(ingest_file("a.xyz", num_reads));
  EXPECT_GT(num_reads, 0);
  EXPECT_TRUE(ingest_file("copy.xyz", num_reads));
  EXPECT_EQ(num_reads, 0);
  EXPECT_FALSE(ingest_file("same_size.xyz", num_reads));
  EXPECT_EQ(store.sources().size(), 2u);
}

TEST_F(IngestTest, AnEmptyCloudIsASourceWithoutPoints) {
  PointStore store = create();
  const IngestReport report = ingest({}, store);
  EXPECT_EQ(report.source.counts, IngestCounts{});
  EXPECT_EQ(store.sources().size(), 1u);
  EXPECT_EQ(store.totals().num_tiles, 0u);
  EXPECT_TRUE(store.verify(true).empty());
}

TEST_F(IngestTest, ABudgetThatOverflowsLosesNothing) {
  // More points than the buffers of the least budget hold: the largest are emptied on the way.
  PointStore store = create();
  std::vector<Vector3> points = wavy_surface(5'500'000, 11, 200.0);
  points.insert(points.end(), points.begin(), points.begin() + 10'000);
  const RunContext context{.memory_bytes = kMinMemoryBytes};
  const IngestCounts counts = ingest(points, store, {}, context).source.counts;
  EXPECT_EQ(counts.num_read, points.size());
  EXPECT_EQ(counts.num_read, counts.num_stored + counts.num_duplicates);
  EXPECT_GT(store.totals().num_blocks, store.totals().num_tiles);

  std::map<TileKey, Digest> expected;
  for (const Vector3& p_world : points) {
    const LatticePoint p = *kLattice.quantize(p_world);
    const std::int64_t xyz[3] = {p.x, p.y, p.z};
    expected[tile_of(p)] += hash128(std::as_bytes(std::span(xyz)));
  }
  std::size_t num_tiles = 0;
  store.for_each_tile([&](const TilePoints& tile) {
    ByteWriter writer;
    writer.put(expected.at(tile.key));
    writer.put(std::int64_t{0});
    ASSERT_EQ(tile.digest, hash128(writer.bytes()));
    ++num_tiles;
  });
  EXPECT_EQ(num_tiles, expected.size());
}

TEST_F(IngestTest, AStopLeavesNothing) {
  class StoppingReader : public MemoryReader {
   public:
    StoppingReader(std::vector<Vector3> points, std::atomic<bool>& stop)
        : MemoryReader(std::move(points)), stop_(&stop) {}
    [[nodiscard]] std::size_t read(std::span<Vector3> points) override {
      if (++num_reads_ == 5) *stop_ = true;
      return MemoryReader::read(points);
    }

   private:
    std::atomic<bool>* stop_;
    int num_reads_ = 0;
  };
  PointStore store = create();
  std::atomic<bool> stop = false;
  const RunContext context{.stop = &stop};
  StoppingReader reader(wavy_surface(100'000, 12), stop);
  const Error error = error_of(
      [&] { static_cast<void>(ingest_points(reader, "memory", kLattice, store, {}, context)); });
  EXPECT_EQ(error.code(), ErrorCode::kInterrupted);
  EXPECT_TRUE(store.sources().empty());
  EXPECT_EQ(store.totals().num_blocks, 0u);
}

TEST_F(IngestTest, AnErrorOfTheReaderGoesOnAndLeavesNothing) {
  class TruncatedReader : public MemoryReader {
   public:
    using MemoryReader::MemoryReader;
    [[nodiscard]] std::size_t read(std::span<Vector3> points) override {
      const std::size_t count = MemoryReader::read(points);
      if (count == 0) throw Error(ErrorCode::kCorrupt, "cloud.ply: vertex 17 of 20: file ends");
      return count;
    }
  };
  PointStore store = create();
  TruncatedReader reader(wavy_surface(200'000, 13, 6.0));
  const Error error = error_of(
      [&] { static_cast<void>(ingest_points(reader, "cloud.ply", kLattice, store, {}, {})); });
  EXPECT_EQ(error.what(), std::string("cloud.ply: vertex 17 of 20: file ends"));
  EXPECT_TRUE(store.sources().empty());
  EXPECT_EQ(db::Database(path(), db::OpenMode::kRead).query_int("SELECT count(*) FROM blocks"), 0);
}

TEST_F(IngestTest, ProgressEndsAtTheTotal) {
  RecordingSink sink;
  PointStore store = create();
  ingest(wavy_surface(2500, 14), store, {}, {.sink = &sink});
  EXPECT_STREQ(sink.last_progress.stage, "points");
  EXPECT_EQ(sink.last_progress.done, 2500u);
  EXPECT_EQ(sink.last_progress.total, 2500u);
}

}  // namespace
}  // namespace gdfmap
