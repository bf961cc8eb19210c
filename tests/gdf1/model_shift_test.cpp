#include <gdfmap/core/failpoint.hpp>

#include "model_files.hpp"

namespace gdfmap {
namespace {

using ShiftedModel = ModelTest;

Box3 box(const Vector3& min, const Vector3& max) { return {min, max}; }

TEST(ExportShift, IsZeroBelow8192Metres) {
  EXPECT_TRUE(export_shift(Box3(), 1.0).isZero(0.0));
  EXPECT_TRUE(export_shift(box({-8191, -10, 0}, {8191, 10, 5}), 1.0).isZero(0.0));
  EXPECT_EQ(export_shift(box({100, 2000, 0}, {8192, 3000, 5}), 1.0), Vector3(0, 1024, 0));
}

TEST(ExportShift, FloorsTheMinimumTo1024Cubes) {
  const Vector3 shift = export_shift(box({500000, 4000000, -3}, {500100, 4000100, 40}), 1.0);
  EXPECT_EQ(shift, Vector3(488 * 1024, 3906 * 1024, -1024));
  EXPECT_EQ(export_shift(box({-9000, 0, 0}, {-8000, 1, 1}), 1.0), Vector3(-9216, 0, 0));
}

TEST(ExportShift, KeepsAMinimumThatIsAMultipleUpToRounding) {
  for (const double size : {0.1, 0.3, 0.7}) {
    for (std::int64_t multiple = 1000; multiple < 1100; ++multiple) {
      const double min = static_cast<double>(multiple * 1024) * size;
      const Vector3 shift = export_shift(box({min, min, min}, {min + 1, min + 1, min + 1}), size);
      EXPECT_DOUBLE_EQ(shift.x(), min);
    }
  }
}

TEST(ExportShift, RefusesAnExtentThatFloat32CannotCarry) {
  EXPECT_NO_THROW((void)export_shift(box({0, 0, 0}, {65536, 1, 1}), 1.0));
  const Error error = error_of([] { (void)export_shift(box({0, 0, 0}, {1, 65537, 1}), 1.0); });
  EXPECT_EQ(error.code(), ErrorCode::kUsage);
  EXPECT_TRUE(contains(error.what(), "--region")) << error.what();
  EXPECT_TRUE(contains(error.what(), "65537 m")) << error.what();
}

TEST(ExportWarning, StatesTheStepOfALargeExtent) {
  EXPECT_FALSE(export_warning(Box3(), 1.0));
  EXPECT_FALSE(export_warning(box({0, 0, 0}, {8000, 1, 1}), 1.0));
  EXPECT_FALSE(export_warning(box({500000, 0, 0}, {505000, 1, 1}), 1.0));
  const auto large = export_warning(box({0, 0, 0}, {20000, 1, 1}), 1.0);
  ASSERT_TRUE(large);
  EXPECT_TRUE(contains(*large, "20000 m")) << *large;
  EXPECT_TRUE(contains(*large, "1.95 mm")) << *large;
  const auto largest = export_warning(box({0, 0, 0}, {65536, 1, 1}), 1.0);
  ASSERT_TRUE(largest);
  EXPECT_TRUE(contains(*largest, "3.91 mm")) << *largest;
}

TEST(ExportWarning, IsDueWhenFlooringTheShiftLeavesCoarseCoordinates) {
  EXPECT_TRUE(export_warning(box({1000 * 1024 + 1000, 0, 0}, {1000 * 1024 + 8500, 1, 1}), 1.0));
}

TEST_F(ShiftedModel, CarriesSmallNumbersAndASidecar) {
  const Gdf1Cube cube = make_cube(500000, 4000000, 2, {kFirst, kSecond});
  const Digest digest{0x0123456789abcdef, 0xfedcba9876543210};
  const Vector3 shift = export_shift(header_of({cube}, 1.0).bounds, 1.0);
  for (const char* name : {"m.bin", "m.csv"}) {
    write_model(path(name), {cube}, 1.0, shift, digest);
    const std::string sidecar = read_text(path(std::string(name) + ".json"));
    EXPECT_TRUE(contains(sidecar, R"("shift":[499712.0,3999744.0,0.0])")) << sidecar;
    EXPECT_TRUE(contains(sidecar, R"("content_digest":"fedcba98765432100123456789abcdef")"));
    const Model model = read_model(path(name));
    ASSERT_EQ(model.cubes.size(), 1u);
    EXPECT_EQ(model.cubes[0].key, cube.key);
    EXPECT_EQ(model.cubes[0].gaussians, cube.gaussians);
    EXPECT_TRUE(model.header.bounds.isApprox(header_of({cube}, 1.0).bounds, 0.0));
    EXPECT_TRUE(read_model_header(path(name)).bounds.isApprox(model.header.bounds, 0.0));
  }
  const std::string bytes = read_text(path("m.bin"));
  EXPECT_EQ(value_at<float>(bytes, 20), 500000.0f - 499712.0f);   // bounds
  EXPECT_EQ(value_at<float>(bytes, 120), 500000.0f - 499712.0f);  // origin
  EXPECT_EQ(value_at<float>(bytes, 148), 288.25f);                // first mean
}

/// 10000 km away the float32 cube size of the header would move cubes by a third of their edge.
TEST_F(ShiftedModel, KeepsTheCubeSizeInFullPrecision) {
  const double size = 1.0 / 3.0;
  const std::vector<Gdf1Cube> cubes = {make_cube(30'000'000, -30'000'000, 5, {kFirst}),
                                       make_cube(30'000'001, -30'000'000, 5, {kFirst})};
  const Vector3 shift = export_shift(header_of(cubes, size).bounds, size);
  for (const char* name : {"m.bin", "m.csv"}) {
    write_model(path(name), cubes, size, shift);
    const Model model = read_model(path(name));
    EXPECT_EQ(model.header.cube_size, size);
    ASSERT_EQ(model.cubes.size(), 2u);
    EXPECT_EQ(model.cubes[0].key, cubes[0].key);
    EXPECT_NEAR(model.header.bounds.min().x(), 1e7, 1e-3);
  }
}

TEST_F(ShiftedModel, IsReadUnderAHandWrittenShift) {
  write_model(path("m.bin"), {make_cube(1, 2, 3, {kFirst})});
  write_text(path("m.bin.json"), R"({"shift": [2048, 0, -1024], "content_digest":
      "00000000000000000000000000000000", "comment": "other keys are passed over"})");
  EXPECT_EQ(read_model(path("m.bin")).cubes.at(0).key, (CubeKey{0, 2049, 2, -1021}));
}

TEST_F(ShiftedModel, LosesItsSidecarToAnUnshiftedOne) {
  write_model(path("m.bin"), {make_cube(0, 0, 0, {kFirst})}, 1.0, Vector3(1024, 0, 0));
  ASSERT_TRUE(std::filesystem::exists(path("m.bin.json")));
  write_model(path("m.bin"), {make_cube(0, 0, 0, {kFirst})});
  EXPECT_FALSE(std::filesystem::exists(path("m.bin.json")));
  EXPECT_EQ(read_model(path("m.bin")).cubes.at(0).key.x, 0);
}

/// As when the ancestor's trainer writes to the name of a model exported by gdfmap.
TEST_F(ShiftedModel, RefusesASidecarOfOtherBytes) {
  for (const char* name : {"m.bin", "m.csv"}) {
    const std::string sidecar_name = std::string(name) + ".json";
    write_model(path(name), {make_cube(0, 0, 0, {kFirst})}, 1.0, Vector3(1024, 0, 0));
    const std::string sidecar = read_text(path(sidecar_name));
    write_model(path(name), {make_cube(0, 0, 0, {kSecond})});
    write_text(path(sidecar_name), sidecar);
    const Error error = error_of([&] { (void)read_model_header(path(name), 1.0); });
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_TRUE(contains(error.what(), sidecar_name)) << error.what();
  }
}

struct Crash {};
const char* crash_at = nullptr;
void crash_handler(const char* name) {
  if (std::string_view(name) == crash_at) throw Crash{};
}

/// Exports over an old model and is stopped between the two files. The old or the new model is read
/// right, or refused: never a model under the other one's shift.
void expect_safe_crash(const std::filesystem::path& path, const Vector3& old_shift,
                       const Vector3& new_shift, const char* failpoint_name) {
  const Gdf1Cube old_cube = make_cube(2048, 0, 0, {kFirst});
  const Gdf1Cube new_cube = make_cube(3072, 0, 0, {kSecond});
  write_model(path, {old_cube}, 1.0, old_shift);
  crash_at = failpoint_name;
  set_failpoint_handler(crash_handler);
  EXPECT_THROW(write_model(path, {new_cube}, 1.0, new_shift), Crash);
  set_failpoint_handler(nullptr);
  try {
    const Gdf1Cube read = read_model(path, 1.0).cubes.at(0);
    const bool is_old = read.gaussians == old_cube.gaussians;
    EXPECT_EQ(read.key, is_old ? old_cube.key : new_cube.key);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt) << error.what();
  }
  write_model(path, {new_cube}, 1.0, new_shift);
  EXPECT_EQ(read_model(path, 1.0).cubes.at(0).key, new_cube.key);
}

TEST_F(ShiftedModel, IsNeverPairedSilentlyWithTheWrongShiftAfterACrash) {
  const Vector3 none = Vector3::Zero(), one(1024, 0, 0), two(2048, 0, 0);
  for (const char* name : {"m.bin", "m.csv"}) {
    expect_safe_crash(path(name), none, one, "gdf1.sidecar_published");
    expect_safe_crash(path(name), one, two, "gdf1.sidecar_published");
    expect_safe_crash(path(name), one, none, "gdf1.model_published");
    expect_safe_crash(path(name), none, one, "gdf1.model_published");
  }
}

}  // namespace
}  // namespace gdfmap
