#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>

#include <gtest/gtest.h>

#include "e2e/expect.hpp"
#include "e2e/map_bytes.hpp"
#include "e2e/scene.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap::test {
namespace {

/// Kills ingest and train at random moments of their run and runs them again: the map must be as if
/// they had never been interrupted. The moments fall anywhere between start and end, map creation
/// included; how many hit a running program depends on the machine and is recorded.
class RandomKill : public ::testing::Test {
 protected:
  RandomKill() {
    write_xyz(path("a.xyz"), square(0.1, 0.0, 0.2, 10.0, 60'000));
    write_xyz(path("b.xyz"), square(4.0, 0.3, 0.7, 8.0, 40'000));
    write_text(path("quick.yaml"),
               "adaptive:\n  populated_steps: [4]\n  empty_steps: [4]\n"
               "  empty_distance_threshold: 0.8\nsolver:\n  max_iterations: 2\n");
  }
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }
  [[nodiscard]] std::vector<std::string> ingest(const std::string& map) const {
    return {"ingest", map, path("a.xyz"), path("b.xyz"), "--memory", "64M"};
  }
  /// Small windows, so that there are many commits.
  [[nodiscard]] std::vector<std::string> train(const std::string& map) const {
    return {"train", map, "--config", path("quick.yaml"), "--memory", "64M"};
  }

  /// Runs to the end and says how long that took.
  std::chrono::microseconds time(const std::vector<std::string>& arguments) {
    const auto start = std::chrono::steady_clock::now();
    EXPECT_TRUE(exits_with(0, gdfmap(arguments)));
    return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() -
                                                                 start);
  }
  /// Whether the program was still running at a random moment of its usual time, where it is
  /// killed.
  bool kill_at_random(const std::vector<std::string>& arguments, std::chrono::microseconds usual) {
    Launch launch;
    launch.program = GDFMAP_PROGRAM;
    launch.arguments = arguments;
    random_ = random_ * 6364136223846793005u + 1442695040888963407u;
    const double fraction = static_cast<double>(random_ >> 11) / 9007199254740992.0;
    launch.kill_after = std::chrono::microseconds(
        static_cast<std::int64_t>(fraction * static_cast<double>(usual.count())));
    return run(launch).signal == SIGKILL;
  }

  void kill_ingest_and_train(int num_moments) {
    const std::string reference = path("reference.gdfmap");
    const auto ingest_time = time(ingest(reference));
    const auto train_time = time(train(reference));
    const MapBytes expected = bytes_of(reference);
    int num_ingest_killed = 0, num_train_killed = 0;
    for (int i = 0; i < num_moments; ++i) {
      SCOPED_TRACE("moment " + std::to_string(i));
      const std::string map = path("killed.gdfmap");
      num_ingest_killed += kill_at_random(ingest(map), ingest_time);
      ASSERT_TRUE(exits_with(0, gdfmap(ingest(map))));
      num_train_killed += kill_at_random(train(map), train_time);
      ASSERT_TRUE(exits_with(0, gdfmap({"verify", map})));
      ASSERT_TRUE(exits_with(0, gdfmap(train(map))));
      ASSERT_TRUE(exits_with(0, gdfmap({"verify", map})));
      ASSERT_EQ(bytes_of(map), expected);
      EXPECT_FALSE(std::filesystem::exists(map + ".new"));
      std::filesystem::remove_all(map);
    }
    RecordProperty("ingest_killed", num_ingest_killed);
    RecordProperty("train_killed", num_train_killed);
  }

  TemporaryDirectory directory_;

 private:
  std::uint64_t random_ = 3;
};

TEST_F(RandomKill, IngestAndTrainRunAgainAreAsIfNeverKilled) { kill_ingest_and_train(3); }

TEST_F(RandomKill, SoakIngestAndTrainKilledFiftyTimesRunAgainAreAsIfNeverKilled) {
  kill_ingest_and_train(50);
}

}  // namespace
}  // namespace gdfmap::test
