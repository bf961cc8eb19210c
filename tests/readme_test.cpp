// The README's first lines of C++, compiled and run.

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/lidar_room.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

// [readme]
#include <gdfmap/pipeline/ingest.hpp>
#include <gdfmap/query/distance_field.hpp>
#include <gdfmap/train/train.hpp>

double clearance(const gdfmap::Vector3& p_world) {
  gdfmap::Map map = gdfmap::Map::create("city.gdfmap");
  gdfmap::ingest("city.ply", map);
  gdfmap::train(map);  // interrupted? run it again
  gdfmap::DistanceField field(map);
  auto [distance, gradient, status, expected_error] = field.at(p_world);
  return status == gdfmap::FieldStatus::kFine ? distance - expected_error : 0.0;
}
// [readme]

// [readme register]
#include <gdfmap/align/registration.hpp>

Eigen::Isometry3d locate(const std::vector<gdfmap::Vector3>& scan, gdfmap::Map& map,
                         const Eigen::Isometry3d& T_map_scan) {
  std::vector<gdfmap::Vector3> scan_map;
  for (const gdfmap::Vector3& p : scan) scan_map.push_back(T_map_scan * p);
  const gdfmap::MapWindow window(map, scan_map, gdfmap::MapWindow::MapOptions{});
  const auto method = gdfmap::make_registration_method("auto");
  const auto result = method->provide(window, gdfmap::Scan(scan), T_map_scan, {});
  return gdfmap::is_usable(result.status) ? result.T_target_source : T_map_scan;
}
// [readme register]

namespace {

using gdfmap::test::read_file;
const std::filesystem::path kSource = GDFMAP_SOURCE_DIR;

std::string between(const std::string& text, const std::string& begin, const std::string& end) {
  const std::size_t from = text.find(begin) + begin.size();
  return text.substr(from, text.find(end, from) - from);
}

TEST(Readme, ShowsTheCodeThatIsTestedHere) {
  const std::string tested =
      between(read_file(kSource / "tests/readme_test.cpp"), "// [readme]\n", "// [readme]");
  EXPECT_EQ(between(read_file(kSource / "README.md"), "```cpp\n", "```"), tested);
}

TEST(Readme, ShowsTheRegistrationThatIsTestedHere) {
  const std::string tested = between(read_file(kSource / "tests/readme_test.cpp"),
                                     "// [readme register]\n", "// [readme register]");
  const std::string section =
      between(read_file(kSource / "README.md"), "## Where is this scan?", "## When");
  EXPECT_EQ(between(section, "```cpp\n", "```"), tested);
}

TEST(Readme, ItsRegistrationWorks) {
  const gdfmap::test::TemporaryDirectory directory;
  const gdfmap::test::LidarPair pair = gdfmap::test::lidar_pair(1);
  gdfmap::Map map = gdfmap::test::map_of(directory / "room.gdfmap", pair.target);
  const Eigen::Isometry3d T = locate(pair.source, map, Eigen::Isometry3d::Identity());
  EXPECT_LT((T.inverse() * pair.T_target_source).translation().norm(), 0.005);
}

TEST(Readme, ItsCodeWorks) {
  const gdfmap::test::TemporaryDirectory directory;
  const auto here = std::filesystem::current_path();
  std::filesystem::current_path(directory.path());
  gdfmap::test::write_cloud("city.ply", gdfmap::test::scene_points("sphere", 3000, 2.0));
  const double at_centre = clearance({0.05, 0.0, 0.0});
  std::filesystem::current_path(here);
  EXPECT_GT(at_centre, 0.0);
}

}  // namespace
