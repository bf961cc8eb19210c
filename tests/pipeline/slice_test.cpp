#include <cmath>

#include <gtest/gtest.h>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/field_access.hpp>
#include <gdfmap/pipeline/slice.hpp>
#include <gdfmap/train/train.hpp>

#include "picture.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

class SliceTest : public testing::Test {
 protected:
  SliceTest() {
    Map map = test::map_of(directory_ / "a.gdfmap", {{{0.5, 0.5, 0.5}}});
    train(map);
  }
  [[nodiscard]] std::shared_ptr<TileSource> source() const {
    return open_tile_source(directory_ / "a.gdfmap");
  }
  test::TemporaryDirectory directory_;
};

TEST_F(SliceTest, ArrayHoldsTheFieldRowByRow) {
  SliceOptions options;
  options.axis = Axis::kZ;
  options.at = {0.5};
  options.resolution = 0.5;
  options.region = Box3(Vector3(0, 0, 0), Vector3(1, 2, 1));
  write_slices(source(), options, directory_ / "a.npy");
  const std::string bytes = test::read_file(directory_ / "a.npy");
  EXPECT_NE(bytes.find("'shape': (5,3,)"), std::string::npos);
  const char* const values = bytes.data() + bytes.size() - 15 * sizeof(float);
  const auto at = [&](int i, int j) {
    return load<float>(reinterpret_cast<const std::byte*>(values) + sizeof(float) * (3 * j + i));
  };
  EXPECT_LT(at(1, 1), 0.2);  // the point itself, the rounded tip of a cone
  EXPECT_NEAR(at(1, 2), 0.5, 0.05);
  EXPECT_NEAR(at(0, 0), std::sqrt(0.5), 0.05);
}

TEST_F(SliceTest, WritesAPicture) {
  SliceOptions options;
  options.at = {0.5};
  write_slices(source(), options, directory_ / "a.png");
  EXPECT_EQ(test::read_file(directory_ / "a.png").substr(1, 3), "PNG");
}

TEST_F(SliceTest, WritesAFileForEachOfSeveralPlanes) {
  SliceOptions options;
  options.axis = Axis::kX;
  options.at = {0.5, -0.75};
  options.arrows = true;
  const auto paths = write_slices(source(), options, directory_ / "a.png");
  const std::vector<std::filesystem::path> expected = {directory_ / "a_x0.5.png",
                                                       directory_ / "a_x-0.75.png"};
  EXPECT_EQ(paths, expected);
  for (const auto& path : paths) EXPECT_EQ(test::read_file(path).substr(1, 3), "PNG");
  EXPECT_FALSE(std::filesystem::exists(directory_ / "a.png"));
  options.at = {0.5, 0.5};
  EXPECT_THROW(write_slices(source(), options, directory_ / "a.png"), Error);
  options.at = {0.5};
  EXPECT_THROW(write_slices(source(), options, directory_ / "a.npy"), Error);  // arrows
}

/// The plane through the point has smaller distances than one 1.5 m off; in one call both are drawn
/// with the colours of the latter.
TEST_F(SliceTest, PlanesOfOneCallShareTheirColours) {
  SliceOptions options;
  options.region = Box3(Vector3(0, 0, -1), Vector3(1, 1, 2));
  options.at = {0.5};
  write_slices(source(), options, directory_ / "alone.png");
  options.at = {0.5, 2.0};
  write_slices(source(), options, directory_ / "a.png");
  const auto luminance_at = [&](const char* name) {
    const test::Picture picture(directory_ / name);
    return luminance(picture.color(picture.width() / 8, picture.height() / 8));
  };
  EXPECT_LT(luminance_at("a_z0.5.png"), 0.8 * luminance_at("alone.png"));
}

TEST_F(SliceTest, RefusesPlanesAndFilesThatMakeNoSense) {
  SliceOptions options;
  options.at = {100.0};
  EXPECT_THROW(write_slices(source(), options, directory_ / "a.png"), Error);
  options.at = {0.5};
  EXPECT_THROW(write_slices(source(), options, directory_ / "a.jpg"), Error);
  options.resolution = 1e-6;
  EXPECT_THROW(write_slices(source(), options, directory_ / "a.png"), Error);
  options.resolution = -1;
  EXPECT_THROW(write_slices(source(), options, directory_ / "a.png"), Error);
}

}  // namespace
}  // namespace gdfmap
