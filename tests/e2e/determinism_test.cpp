#include <gtest/gtest.h>

#include "e2e/expect.hpp"
#include "e2e/map_bytes.hpp"
#include "e2e/scene.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap::test {
namespace {

/// GDF1, CSV and content digest depend on the points and the configuration alone.
class Determinism : public ::testing::Test {
 protected:
  Determinism() {
    write_xyz(path("a.xyz"), first_scan());
    write_xyz(path("b.xyz"), second_scan());
    std::vector<Vector3> all = first_scan();
    const std::vector<Vector3> more = second_scan();
    all.insert(all.end(), more.begin(), more.end());
    write_xyz(path("all.xyz"), all);
    write_xyz(path("shuffled.xyz"), shuffled(all));
  }
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }

  void ingest(const std::string& map, std::vector<std::string> clouds,
              const std::vector<std::string>& options = {}) {
    for (std::string& cloud : clouds) cloud = path(cloud);
    std::vector<std::string> command = {"ingest", path(map)};
    command.insert(command.end(), clouds.begin(), clouds.end());
    command.insert(command.end(), options.begin(), options.end());
    EXPECT_TRUE(exits_with(0, gdfmap(command)));
  }
  void train(const std::string& map, const std::vector<std::string>& options = {}) {
    std::vector<std::string> command = {"train", path(map)};
    command.insert(command.end(), options.begin(), options.end());
    EXPECT_TRUE(exits_with(0, gdfmap(command)));
  }
  /// The plain way: both clouds at once, defaults.
  MapBytes reference() {
    ingest("reference.gdfmap", {"a.xyz", "b.xyz"});
    train("reference.gdfmap");
    return bytes_of(path("reference.gdfmap"));
  }

  TemporaryDirectory directory_;
};

TEST_F(Determinism, ThreadsDoNotMatter) {
  for (const char* threads : {"1", "2", "5"}) {
    ingest(std::string(threads) + ".gdfmap", {"a.xyz", "b.xyz"});
    train(std::string(threads) + ".gdfmap", {"--threads", threads});
  }
  const MapBytes one = bytes_of(path("1.gdfmap"));
  EXPECT_EQ(bytes_of(path("2.gdfmap")), one);
  EXPECT_EQ(bytes_of(path("5.gdfmap")), one);
}

TEST_F(Determinism, MemoryDoesNotMatter) {
  for (const char* memory : {"64M", "2G"}) {
    ingest(std::string(memory) + ".gdfmap", {"a.xyz", "b.xyz"}, {"--memory", memory});
    train(std::string(memory) + ".gdfmap", {"--memory", memory});
  }
  EXPECT_EQ(bytes_of(path("64M.gdfmap")), bytes_of(path("2G.gdfmap")));
}

TEST_F(Determinism, OrderOfPointsAndDivisionIntoCloudsDoNotMatter) {
  const MapBytes expected = reference();
  for (const char* cloud : {"all", "shuffled"}) {
    const std::string map = std::string(cloud) + ".gdfmap";
    ingest(map, {std::string(cloud) + ".xyz"});
    train(map);
    EXPECT_EQ(bytes_of(path(map)), expected) << cloud;
  }
}

TEST_F(Determinism, OrderOfCloudsAndTrainingInBetweenDoNotMatter) {
  const MapBytes expected = reference();
  ingest("ba.gdfmap", {"b.xyz", "a.xyz"});
  train("ba.gdfmap");
  EXPECT_EQ(bytes_of(path("ba.gdfmap")), expected);

  ingest("a_then_b.gdfmap", {"a.xyz"});
  train("a_then_b.gdfmap");
  EXPECT_NE(bytes_of(path("a_then_b.gdfmap")), expected);
  ingest("a_then_b.gdfmap", {"b.xyz"});
  train("a_then_b.gdfmap");
  EXPECT_EQ(bytes_of(path("a_then_b.gdfmap")), expected);

  ingest("b_then_a.gdfmap", {"b.xyz"});
  train("b_then_a.gdfmap");
  ingest("b_then_a.gdfmap", {"a.xyz"});
  train("b_then_a.gdfmap");
  EXPECT_EQ(bytes_of(path("b_then_a.gdfmap")), expected);
}

TEST_F(Determinism, TheSameCloudOrTrainAgainChangesNothing) {
  const MapBytes expected = reference();
  ingest("reference.gdfmap", {"a.xyz"});
  train("reference.gdfmap");
  EXPECT_EQ(bytes_of(path("reference.gdfmap")), expected);
  const Result again = gdfmap({"train", path("reference.gdfmap"), "--json"});
  EXPECT_NE(again.out.find("\"num_tiles_trained\": 0"), std::string::npos) << again.out;
}

TEST_F(Determinism, AnswersDoNotDependOnThreadsOrMemory) {
  reference();
  const auto answers = [&](const char* threads, const char* memory) {
    const Result result = gdfmap({"query", path("reference.gdfmap"), "--points",
                                  path("shuffled.xyz"), "--threads", threads, "--memory", memory});
    EXPECT_TRUE(exits_with(0, result));
    return result.out;
  };
  const std::string expected = answers("1", "64M");
  EXPECT_EQ(std::count(expected.begin(), expected.end(), '\n'), 1 + 3500);
  EXPECT_EQ(answers("2", "64M"), expected);
  EXPECT_EQ(answers("2", "2G"), expected);
}

TEST_F(Determinism, SynthMakesTheSameFileWithAnyNumberOfThreads) {
  for (const char* threads : {"1", "2"}) {
    EXPECT_TRUE(
        exits_with(0, gdfmap({"synth", "room", path(std::string(threads) + ".xyz"), "--points",
                              "20000", "--noise", "0.01", "--threads", threads})));
  }
  ingest("1.gdfmap", {"1.xyz"});
  const Result again = gdfmap({"ingest", path("1.gdfmap"), path("2.xyz"), "--json"});
  EXPECT_NE(again.out.find("\"already_present\": true"), std::string::npos) << again.out;
}

}  // namespace
}  // namespace gdfmap::test
