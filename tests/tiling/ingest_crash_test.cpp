#include <cerrno>
#include <csignal>
#include <tuple>

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gdfmap/core/failpoint.hpp>

#include "tiling_fixtures.hpp"

namespace gdfmap {
namespace {

using IngestCrashTest = TilingTest;

/// Enough for several appends.
std::vector<Vector3> cloud() { return wavy_surface(1'200'000, 21, 60.0); }

/// What the store lists: every tile with its digest, cubes and number of stored points.
using Listing =
    std::vector<std::tuple<TileKey, Digest, std::array<std::uint64_t, 8>, std::uint64_t>>;

Listing listing_of(PointStore& store) {
  Listing listing;
  store.for_each_tile([&](const TilePoints& tile) {
    listing.emplace_back(tile.key, tile.digest, tile.cubes.words(), tile.num_points);
  });
  return listing;
}

std::string awaited_place;
int calls_left = 0;

void kill_here(const char* name) {
  if (awaited_place == name && --calls_left == 0) ::kill(::getpid(), SIGKILL);
}

void throw_here(const char* name) {
  if (awaited_place == name) throw std::runtime_error(name);
}

/// Ingests in a child that is killed at the nth call of a failpoint; whether it was.
bool ingest_killed_at(const std::filesystem::path& path, const char* place, int nth) {
  const pid_t child = ::fork();
  if (child == 0) {
    awaited_place = place;
    calls_left = nth;
    set_failpoint_handler(kill_here);
    PointStore store(path, db::OpenMode::kCreate);
    ingest(cloud(), store);
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
}

TEST_F(IngestCrashTest, KilledAnywhereAndRunAgainIsAsIfNeverInterrupted) {
  Listing expected;
  {
    PointStore store = create("expected.db");
    ingest(cloud(), store);
    expected = listing_of(store);
  }
  struct Place {
    const char* name;
    int nth;
    bool published;
  };
  for (const Place& place :
       {Place{"ingest.before_append", 1, false}, Place{"ingest.before_append", 2, false},
        Place{"ingest.after_append", 1, false}, Place{"ingest.after_append", 2, false},
        Place{"ingest.before_publish", 1, false}, Place{"ingest.after_publish", 1, true}}) {
    SCOPED_TRACE(std::string(place.name) + " " + std::to_string(place.nth));
    const std::string name = std::string(place.name) + std::to_string(place.nth) + ".db";
    ASSERT_TRUE(ingest_killed_at(path(name), place.name, place.nth));
    {
      PointStore reader(path(name), db::OpenMode::kRead);
      EXPECT_EQ(reader.sources().size(), place.published ? 1u : 0u);
      EXPECT_EQ(reader.totals().num_points > 0, place.published);
    }
    PointStore store(path(name), db::OpenMode::kCreate);
    EXPECT_EQ(ingest(cloud(), store).already_present, place.published);
    EXPECT_EQ(listing_of(store), expected);
    EXPECT_EQ(store.sources().size(), 1u);
    EXPECT_TRUE(store.verify(true).empty());
  }
}

TEST_F(IngestCrashTest, AFailureBeforePublicationLeavesNothingAndOneAfterItLosesNothing) {
  struct Handler {
    Handler() { set_failpoint_handler(throw_here); }
    ~Handler() { set_failpoint_handler(nullptr); }
  } const handler;
  PointStore store = create();
  const std::vector<Vector3> points = wavy_surface(10'000, 22);
  for (const char* const place :
       {"ingest.before_append", "ingest.after_append", "ingest.before_publish"}) {
    awaited_place = place;
    EXPECT_THROW(ingest(points, store), std::runtime_error);
    EXPECT_TRUE(store.sources().empty());
    EXPECT_EQ(db::Database(path(), db::OpenMode::kRead).query_int("SELECT count(*) FROM sources"),
              0);
  }
  awaited_place = "ingest.after_publish";
  EXPECT_THROW(ingest(points, store), std::runtime_error);
  EXPECT_EQ(store.sources().size(), 1u);
  awaited_place = "";
  EXPECT_TRUE(ingest(points, store).already_present);
  EXPECT_TRUE(store.verify(true).empty());
}

/// A file system of four megabytes.
class SmallDisk {
 public:
  explicit SmallDisk(std::filesystem::path directory) : directory_(std::move(directory)) {
    std::filesystem::create_directory(directory_);
    mounted_ = ::mount("tmpfs", directory_.c_str(), "tmpfs", 0, "size=4m") == 0;
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(directory_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  [[nodiscard]] bool is_mounted() const { return mounted_; }

 private:
  std::filesystem::path directory_;
  bool mounted_ = false;
};

TEST_F(IngestCrashTest, ACloudForWhichThereIsNoRoomIsRefusedBeforeItIsRead) {
  const SmallDisk disk(path("small"));
  if (!disk.is_mounted()) {
    GTEST_SKIP() << "a small file system cannot be mounted: " << std::strerror(errno);
  }
  PointStore store = create("small/points.db");
  MemoryReader reader(cloud());
  const Error error = error_of(
      [&] { static_cast<void>(ingest_points(reader, "big.ply", kLattice, store, {}, {})); });
  EXPECT_EQ(error.code(), ErrorCode::kIo);
  EXPECT_NE(std::string(error.what()).find("big.ply: its 1200000 points need about 10 MiB"),
            std::string::npos)
      << error.what();
  EXPECT_NE(std::string(error.what()).find("small"), std::string::npos) << error.what();
  EXPECT_EQ(db::Database(path("small/points.db"), db::OpenMode::kRead)
                .query_int("SELECT count(*) FROM sources"),
            0);
  IngestOptions options;  // of a part nobody knows the size
  options.region = Box3(Vector3(0, 0, -50), Vector3(1, 1, 50));
  MemoryReader again(cloud());
  EXPECT_FALSE(ingest_points(again, "big.ply", kLattice, store, options, {}).already_present);
}

TEST_F(IngestCrashTest, AFullDiskIsSaidAndLeavesThePublishedSources) {
  class SilentReader : public MemoryReader {  // as text files and pipes, which declare no number
   public:
    using MemoryReader::MemoryReader;
    [[nodiscard]] const CloudInfo& info() const override { return none_; }

   private:
    CloudInfo none_;
  };
  const SmallDisk disk(path("small"));
  if (!disk.is_mounted()) {
    GTEST_SKIP() << "a small file system cannot be mounted: " << std::strerror(errno);
  }
  const std::vector<Vector3> small = wavy_surface(10'000, 23);
  PointStore store = create("small/points.db");
  ingest(small, store);
  const Content before = content_of(store);
  SilentReader reader(cloud());
  const Error error =
      error_of([&] { static_cast<void>(ingest_points(reader, "pipe", kLattice, store, {}, {})); });
  EXPECT_EQ(error.code(), ErrorCode::kIo);
  EXPECT_NE(std::string(error.what()).find("full"), std::string::npos) << error.what();
  EXPECT_EQ(content_of(store), before);
  EXPECT_EQ(store.sources().size(), 1u);
  EXPECT_TRUE(store.verify(true).empty());
  EXPECT_FALSE(ingest(wavy_surface(10'000, 24), store).already_present);  // there is room again
}

/// Every point in a tile of its own, scattered, generated as it is read.
class ScatteredReader : public PointReader {
 public:
  explicit ScatteredReader(std::uint64_t num_points) : num_left_(num_points) {
    info_.num_points = num_points;
  }
  [[nodiscard]] const CloudInfo& info() const override { return info_; }
  [[nodiscard]] std::size_t read(std::span<Vector3> points) override {
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(points.size(), num_left_));
    for (Vector3& p : points.first(count)) p = {coordinate(), coordinate(), 1.0};
    num_left_ -= count;
    return count;
  }
  [[nodiscard]] Digest identity() override { return {1, 1}; }
  [[nodiscard]] std::uint64_t num_bytes() const override { return 1; }

 private:
  double coordinate() { return static_cast<double>(random_()) * 0x1p-32 * 1e6; }

  CloudInfo info_;
  std::uint64_t num_left_;
  std::mt19937 random_{31};
};

std::size_t peak_bytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

TEST_F(IngestCrashTest, MemoryStaysWithinTheBudgetForAnyNumberOfTiles) {
#if defined(GDFMAP_SANITIZED)
  GTEST_SKIP() << "sanitizers need memory of their own";
#endif
  const pid_t child = ::fork();
  if (child == 0) {
    const std::size_t before = peak_bytes();  // what other tests of this process have left
    PointStore store(path(), db::OpenMode::kCreate);
    ScatteredReader reader(400'000);  // more tiles than the buffers hold
    const RunContext context{.memory_bytes = kMinMemoryBytes};
    static_cast<void>(ingest_points(reader, "scattered", kLattice, store, {}, context));
    ::_exit(peak_bytes() - before <= kMinMemoryBytes ? 0 : 1);
  }
  int status = 1;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace gdfmap
