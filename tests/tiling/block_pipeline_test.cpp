#include <atomic>
#include <fstream>

#include <gtest/gtest.h>

#include <gdfmap/core/failpoint.hpp>

#include "tiling_fixtures.hpp"

namespace gdfmap {
namespace {

using BlockPipelineTest = TilingTest;

std::string bytes_of_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST_F(BlockPipelineTest, ThreadsChangeNeitherCountsNorBytes) {
  const std::vector<Vector3> points = wavy_surface(600'000, 1, 40.0);
  IngestCounts expected;
  for (const int threads : {1, 2, 7}) {
    SCOPED_TRACE(threads);
    {
      PointStore store = create(std::to_string(threads));
      const RunContext context{.num_threads = threads};
      const IngestCounts counts = ingest(points, store, {}, context).source.counts;
      if (threads == 1) expected = counts;
      EXPECT_EQ(counts, expected);
    }
    EXPECT_EQ(bytes_of_file(path(std::to_string(threads))), bytes_of_file(path("1")));
  }
}

TEST_F(BlockPipelineTest, MemoryChangesNoPointAndNoDigest) {
  const std::vector<Vector3> points = wavy_surface(5'500'000, 2, 120.0);
  PointStore little = create("little"), plenty = create("plenty");
  ingest(points, little, {}, {.num_threads = 3, .memory_bytes = kMinMemoryBytes});
  ingest(points, plenty, {}, {.num_threads = 2, .memory_bytes = std::size_t{1} << 30});
  EXPECT_GT(little.totals().num_blocks, plenty.totals().num_blocks);
  EXPECT_EQ(content_of(little), content_of(plenty));
}

TEST_F(BlockPipelineTest, AnErrorOfTheWriterEndsTheIngestWhereverItIs) {
  static std::atomic<int> calls_left;
  struct Handler {
    Handler() {
      set_failpoint_handler([](const char* name) {
        if (std::string(name) == "ingest.before_append" && --calls_left == 0) {
          throw Error(ErrorCode::kIo, "database or disk is full");
        }
      });
    }
    ~Handler() { set_failpoint_handler(nullptr); }
  } const handler;
  const std::vector<Vector3> points = wavy_surface(1'500'000, 3, 8.0);  // many blocks on the way
  PointStore store = create();
  for (const int call : {1, 2}) {
    calls_left = call;
    EXPECT_EQ(error_of([&] { ingest(points, store); }).what(),
              std::string("database or disk is full"));
    EXPECT_TRUE(store.sources().empty());
  }
  calls_left = 0;
  EXPECT_FALSE(ingest(points, store).already_present);
  EXPECT_TRUE(store.verify(true).empty());
}

}  // namespace
}  // namespace gdfmap
