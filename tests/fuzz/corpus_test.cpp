#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/map_fixture.hpp"
#include "targets.hpp"

namespace gdfmap::fuzz {

/// How googletest names a target; without it, by its bytes, which differ from run to run.
static void PrintTo(const Target& target, std::ostream* stream) { *stream << target.name; }

namespace {

namespace fs = std::filesystem;

class FuzzCorpus : public ::testing::TestWithParam<Target> {};

/// Every input that is kept: seeds, and those that once found a defect. A target ends the process
/// when it finds one.
TEST_P(FuzzCorpus, IsReadOrRefusedAndNothingElse) {
  const fs::path directory = fs::path(GDFMAP_SOURCE_DIR) / "tests/fuzz/corpus" / GetParam().name;
  int num_accepted = 0;
  for (const auto& entry : fs::directory_iterator(directory)) {
    const std::string bytes = test::read_file(entry.path());
    const bool accepted = GetParam().run(std::as_bytes(std::span(bytes)));
    if (entry.path().filename().string().starts_with("valid_")) {
      EXPECT_TRUE(accepted) << entry.path() << ": the fuzzer starts from a seed that is refused";
    }
    num_accepted += accepted;
  }
  EXPECT_GT(num_accepted, 0);
}

/// Seeds cut short and with one byte changed reach every check of a header, without a fuzzer.
TEST_P(FuzzCorpus, IsSurvivedWithAnyByteMissingOrChanged) {
  const fs::path directory = fs::path(GDFMAP_SOURCE_DIR) / "tests/fuzz/corpus" / GetParam().name;
  for (const auto& entry : fs::directory_iterator(directory)) {
    const std::string bytes = test::read_file(entry.path());
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      static_cast<void>(GetParam().run(std::as_bytes(std::span(bytes).first(i))));
      for (const char change : {'\x01', '\x80', '\xff'}) {
        std::string damaged = bytes;
        damaged[i] = static_cast<char>(damaged[i] ^ change);
        static_cast<void>(GetParam().run(std::as_bytes(std::span(damaged))));
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, FuzzCorpus, ::testing::ValuesIn(kTargets),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace gdfmap::fuzz
