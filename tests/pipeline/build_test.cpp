#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/build.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

class BuildTest : public testing::Test {
 protected:
  BuildTest() {
    test::write_cloud(directory_ / "in.ply", test::scene_points("sphere", 500));
    configuration_.input_file = directory_ / "in.ply";
    configuration_.output_base = directory_ / "out";
    configuration_.populated_steps = {4};
    configuration_.empty_steps = {2};
    configuration_.max_iterations = 3;
  }
  test::TemporaryDirectory directory_;
  Configuration configuration_;
};

TEST_F(BuildTest, WritesMapModelAndCsv) {
  const BuildReport report = build(configuration_);
  EXPECT_GT(report.train.num_cubes_fitted, 0);
  for (const char* name : {"out.gdfmap", "out.bin", "out.csv"}) {
    EXPECT_TRUE(std::filesystem::exists(directory_ / name)) << name;
  }
}

TEST_F(BuildTest, ASecondRunFindsNothingToDo) {
  build(configuration_);
  const std::string bin = test::read_file(directory_ / "out.bin");
  const BuildReport report = build(configuration_);
  EXPECT_TRUE(report.ingest.already_present);
  EXPECT_EQ(report.train.num_cubes_fitted, 0);
  EXPECT_EQ(test::read_file(directory_ / "out.bin"), bin);
}

TEST_F(BuildTest, FollowsAChangedConfiguration) {
  build(configuration_);
  configuration_.max_iterations = 4;
  EXPECT_GT(build(configuration_).train.num_cubes_fitted, 0);
}

TEST_F(BuildTest, RefusesAMapOfAnotherCloudAndLeavesItAlone) {
  build(configuration_);
  test::write_cloud(directory_ / "other.ply", test::scene_points("box", 500));
  configuration_.input_file = directory_ / "other.ply";
  EXPECT_THROW(build(configuration_), Error);
  Map map = Map::open(directory_ / "out.gdfmap", Access::kRead);
  EXPECT_EQ(map.points().sources().size(), 1u);
}

TEST_F(BuildTest, ACloudThatCannotBeReadLeavesNoMap) {
  configuration_.input_file = directory_ / "missing.ply";
  EXPECT_THROW(build(configuration_), Error);
  EXPECT_FALSE(std::filesystem::exists(directory_ / "out.gdfmap"));
  std::ofstream(directory_ / "damaged.xyz") << "1 2 3\n1 2 three\n";
  configuration_.input_file = directory_ / "damaged.xyz";
  EXPECT_THROW(build(configuration_), Error);
  EXPECT_FALSE(std::filesystem::exists(directory_ / "out.gdfmap"));
}

TEST_F(BuildTest, NeedsInputAndOutput) {
  configuration_.output_base.clear();
  EXPECT_THROW(build(configuration_), Error);
}

}  // namespace
}  // namespace gdfmap
