#include <chrono>
#include <csignal>
#include <filesystem>

#include <gtest/gtest.h>

#include "e2e/expect.hpp"
#include "e2e/map_bytes.hpp"
#include "e2e/scene.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap::test {
namespace {

constexpr int kInterrupted = 5;

/// The job of every test here: two scans ingested, one tile a commit.
class Interruption : public ::testing::Test {
 protected:
  Interruption() {
    write_xyz(path("a.xyz"), first_scan());
    write_xyz(path("b.xyz"), second_scan());
  }
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }
  [[nodiscard]] std::vector<std::string> ingest(const std::string& map) const {
    return {"ingest", map, path("a.xyz"), path("b.xyz")};
  }
  [[nodiscard]] static std::vector<std::string> train(const std::string& map) {
    return {"train", map, "--memory", "64M"};
  }
  MapBytes uninterrupted() {
    const std::string map = path("uninterrupted.gdfmap");
    EXPECT_TRUE(exits_with(0, gdfmap(ingest(map))));
    EXPECT_TRUE(exits_with(0, gdfmap(train(map))));
    return bytes_of(map);
  }

  TemporaryDirectory directory_;
};

TEST_F(Interruption, IngestKilledAroundAnyCommitAndRunAgainIsAsIfNeverKilled) {
  const MapBytes expected = uninterrupted();
  for (const char* name : {"ingest.before_append", "ingest.after_append", "ingest.before_publish",
                           "ingest.after_publish"}) {
    for (const char* count : {"1", "2"}) {
      const std::string failpoint = std::string(name) + ":" + count;
      SCOPED_TRACE(failpoint);
      const std::string map = path(failpoint + ".gdfmap");
      ASSERT_EQ(gdfmap_until(failpoint, ingest(map)).signal, SIGKILL);
      EXPECT_TRUE(exits_with(0, gdfmap(ingest(map))));
      EXPECT_TRUE(exits_with(0, gdfmap(train(map))));
      EXPECT_TRUE(exits_with(0, gdfmap({"verify", map})));
      EXPECT_EQ(bytes_of(map), expected);
    }
  }
}

TEST_F(Interruption, TrainKilledAroundAnyCommitAndRunAgainIsAsIfNeverKilled) {
  const MapBytes expected = uninterrupted();
  for (const char* failpoint :
       {"train.before_occupied:1", "train.after_occupied:1", "train.before_commit:1",
        "train.after_commit:1", "train.before_commit:3", "train.after_commit:3"}) {
    SCOPED_TRACE(failpoint);
    const std::string map = path(std::string(failpoint) + ".gdfmap");
    ASSERT_TRUE(exits_with(0, gdfmap(ingest(map))));
    ASSERT_EQ(gdfmap_until(failpoint, train(map)).signal, SIGKILL);
    EXPECT_TRUE(exits_with(0, gdfmap({"verify", map})));
    EXPECT_TRUE(exits_with(0, gdfmap(train(map))));
    EXPECT_EQ(bytes_of(map), expected);
  }
}

TEST_F(Interruption, TrainKilledAfterMorePointsCameIsCaughtUp) {
  const MapBytes expected = uninterrupted();
  const std::string map = path("m.gdfmap");
  ASSERT_TRUE(exits_with(0, gdfmap({"ingest", map, path("a.xyz")})));
  ASSERT_TRUE(exits_with(0, gdfmap(train(map))));
  ASSERT_EQ(gdfmap_until("ingest.after_publish:1", {"ingest", map, path("b.xyz")}).signal, SIGKILL);
  ASSERT_EQ(gdfmap_until("train.after_commit:2", train(map)).signal, SIGKILL);
  EXPECT_TRUE(exits_with(0, gdfmap(train(map))));
  EXPECT_EQ(bytes_of(map), expected);
}

TEST_F(Interruption, TrainAskedToStopCommitsWhatIsFinishedAndContinuesWhenRunAgain) {
  const MapBytes expected = uninterrupted();
  const std::string map = path("m.gdfmap");
  ASSERT_TRUE(exits_with(0, gdfmap(ingest(map))));
  const auto start = std::chrono::steady_clock::now();
  const Result stopped = gdfmap_until("train.before_commit:2:TERM", train(map));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
  EXPECT_TRUE(refuses(kInterrupted, "train", "interrupted", stopped));
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", map})));
  const Result listed = gdfmap({"tile", map, "--list"});
  EXPECT_EQ(std::count(listed.out.begin(), listed.out.end(), '\n'), 1 + 2) << listed.out;
  EXPECT_TRUE(exits_with(0, gdfmap(train(map))));
  EXPECT_EQ(bytes_of(map), expected);
}

TEST_F(Interruption, ASecondSignalEndsTrainAtOnce) {
  const MapBytes expected = uninterrupted();
  const std::string map = path("m.gdfmap");
  ASSERT_TRUE(exits_with(0, gdfmap(ingest(map))));
  const Result stopped = gdfmap_until("train.before_commit:2:TERM:2", train(map));
  EXPECT_TRUE(exits_with(kInterrupted, stopped));
  EXPECT_EQ(stopped.err.find("error"), std::string::npos) << stopped.err;
  const Result listed = gdfmap({"tile", map, "--list"});
  EXPECT_EQ(std::count(listed.out.begin(), listed.out.end(), '\n'), 1 + 1) << listed.out;
  EXPECT_TRUE(exits_with(0, gdfmap(train(map))));
  EXPECT_EQ(bytes_of(map), expected);
}

TEST_F(Interruption, IngestAskedToStopDiscardsTheSourceThatIsUnpublished) {
  const MapBytes expected = uninterrupted();
  const std::string map = path("m.gdfmap");
  // Asked while the first cloud is published: it stays, the second one is not begun.
  const Result stopped = gdfmap_until("ingest.before_publish:1:TERM", ingest(map));
  EXPECT_TRUE(refuses(kInterrupted, "ingest", "interrupted", stopped));
  EXPECT_EQ(Map::open(map, Access::kRead).points().sources().size(), 1u);
  EXPECT_TRUE(exits_with(0, gdfmap(ingest(map))));
  EXPECT_TRUE(exits_with(0, gdfmap(train(map))));
  EXPECT_EQ(bytes_of(map), expected);
}

TEST_F(Interruption, IngestAskedToStopWhileItIsTheFirstLeavesNoMap) {
  write_xyz(path("empty.xyz"), {});
  const std::string map = path("m.gdfmap");
  const Result stopped =
      gdfmap_until("ingest.before_append:1:TERM", {"ingest", map, path("a.xyz")});
  // The request comes with the last block: either the source is whole or it is not there.
  if (stopped.exit_code == 0) {
    EXPECT_EQ(Map::open(map, Access::kRead).points().sources().size(), 1u);
  } else {
    EXPECT_TRUE(refuses(kInterrupted, "ingest", "interrupted", stopped));
    EXPECT_FALSE(std::filesystem::exists(map));
  }
}

TEST_F(Interruption, ExportKilledAndRunAgainWritesTheSameFile) {
  const MapBytes expected = uninterrupted();
  const std::string map = path("uninterrupted.gdfmap");
  ASSERT_EQ(gdfmap_until("gdf1.model_published:1", {"export", map, path("out.bin")}).signal,
            SIGKILL);
  EXPECT_EQ(read_file(path("out.bin")), expected.bin);
  EXPECT_TRUE(exits_with(0, gdfmap({"export", map, path("out.bin")})));
  EXPECT_EQ(read_file(path("out.bin")), expected.bin);
}

TEST_F(Interruption, ExportKilledBetweenShiftAndModelIsNeverTakenForUnshifted) {
  write_xyz(path("far.xyz"), square(20'000.5, 0.5, 0.5, 1.0, 500));
  const std::string map = path("m.gdfmap");
  const std::string at = "20000.5,0.5,0.7";
  ASSERT_TRUE(exits_with(0, gdfmap({"ingest", map, path("far.xyz")})));
  ASSERT_TRUE(exits_with(0, gdfmap(train(map))));
  const std::vector<std::string> command = {"export", map, path("out.bin")};
  ASSERT_EQ(gdfmap_until("gdf1.sidecar_published:1", command).signal, SIGKILL);
  EXPECT_FALSE(std::filesystem::exists(path("out.bin")));
  EXPECT_TRUE(exits_with(0, gdfmap(command)));
  const Result answer = gdfmap({"query", path("out.bin"), "--at", at});
  EXPECT_TRUE(exits_with(0, answer));
  EXPECT_NE(answer.out.find(",fine,"), std::string::npos) << answer.out;
}

}  // namespace
}  // namespace gdfmap::test
