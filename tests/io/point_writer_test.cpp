#include "io_test_support.hpp"

namespace gdfmap::io_test {
namespace {

/// Deterministic points, large and small, more than a writer's block.
Points sample_points(std::size_t count = 10'000) {
  Points points;
  std::uint64_t state = 1;
  const auto next = [&] {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state >> 11) * 0x1p-53 * 2000.0 - 1000.0;
  };
  for (std::size_t i = 0; i < count; ++i) points.emplace_back(next(), next() + 5e6, next() * 1e-3);
  return points;
}

const WriterOptions kNearby = {.las_offset = {0.0, 5e6, 0.0}};

void write_all(const std::filesystem::path& path, const Points& points,
               const WriterOptions& options = {}) {
  const auto writer = create_point_cloud(path, options);
  const std::span<const Vector3> all(points);
  const std::size_t half = points.size() / 2;
  writer->write(all.first(half));
  writer->write(all.subspan(half));
  writer->finish();
}

TEST(PointWriter, GivesBackTheSameDoublesInEveryFormatThatHoldsThem) {
  const TestDirectory directory;
  const Points points = sample_points();
  for (const auto& [name, format] :
       {std::pair{"a.ply", "PLY binary_little_endian"}, std::pair{"a.PCD", "PCD binary"},
        std::pair{"a.xyz", "XYZ"}, std::pair{"a.csv", "XYZ"}, std::pair{"a.txt", "XYZ"}}) {
    SCOPED_TRACE(name);
    write_all(directory / name, points);
    const auto reader = open_point_cloud(directory / name);
    EXPECT_EQ(reader->info().format, format);
    expect_points(read_rest(*reader), points);
  }
}

TEST(PointWriter, RoundsToFloatsWhereAsked) {
  const TestDirectory directory;
  const Points points = sample_points();
  Points rounded;
  for (const Vector3& p : points) rounded.push_back(p.cast<float>().cast<double>());
  for (const char* name : {"f.ply", "f.pcd"}) {
    write_all(directory / name, points, {.double_precision = false});
    expect_points(read_points(directory / name), rounded);
  }
}

TEST(PointWriter, RoundsToTheStepsOfLas) {
  const TestDirectory directory;
  const Points points = sample_points();
  const WriterOptions options{.las_scale = 0.01, .las_offset = {100.0, 5e6, -2.0}};
  write_all(directory / "s.las", points, options);
  const auto reader = open_point_cloud(directory / "s.las");
  EXPECT_EQ(reader->info().format, "LAS 1.4 format 6");
  const Points read = read_rest(*reader);
  ASSERT_EQ(read.size(), points.size());
  EXPECT_EQ(reader->num_withheld(), 0u);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_LE((read[i] - points[i]).cwiseAbs().maxCoeff(), 0.005 + 1e-8) << "point " << i;
  }
}

TEST(PointWriter, StatesTheBoundsAndCountsOfLas) {
  const TestDirectory directory;
  write_all(directory / "b.las", {{1, -2, 3}, {-4, 5, 6}, {0, 0, -7}});
  const std::string bytes = file_bytes(directory / "b.las");
  ASSERT_EQ(bytes.size(), 375u + 3 * 30u);
  EXPECT_EQ(bytes.substr(179, 48), raw_list({1.0, -4.0, 5.0, -2.0, 6.0, -7.0}));
  EXPECT_EQ(bytes.substr(107, 4), raw(0u));
  EXPECT_EQ(bytes.substr(247, 16), raw_list({std::uint64_t{3}, std::uint64_t{3}}));
}

TEST(PointWriter, RefusesPointsThatLasCannotExpress) {
  const TestDirectory directory;
  for (const Vector3& p :
       {Vector3(1, 2, 3e6), Vector3(1, std::nan(""), 3), Vector3(-HUGE_VAL, 2, 3)}) {
    const auto writer = create_point_cloud(directory / "r.las");
    const Points points = {{0, 0, 0}, p};
    const Error error = error_of([&] { writer->write(points); });
    EXPECT_EQ(error.code(), ErrorCode::kUsage);
    EXPECT_NE(std::string(error.what()).find("r.las: point 2"), std::string::npos) << error.what();
  }
  for (const WriterOptions& options :
       {WriterOptions{.las_scale = 0.0}, WriterOptions{.las_scale = std::nan("")},
        WriterOptions{.las_offset = {0.0, HUGE_VAL, 0.0}}}) {
    EXPECT_EQ(error_of([&] {
                static_cast<void>(create_point_cloud(directory / "o.las", options));
              }).code(),
              ErrorCode::kUsage);
  }
}

TEST(PointWriter, KeepsNotANumberWhereTheFormatHasIt) {
  const TestDirectory directory;
  const Points points = {{std::nan(""), 1, -HUGE_VAL}, {1, 2, 3}};
  for (const char* name : {"n.ply", "n.pcd", "n.csv", "n.xyz"}) {
    SCOPED_TRACE(name);
    write_all(directory / name, points);
    expect_points(read_points(directory / name), points);
  }
}

TEST(PointWriter, WritesAnEmptyCloud) {
  const TestDirectory directory;
  for (const char* name : {"e.ply", "e.pcd", "e.las", "e.csv"}) {
    SCOPED_TRACE(name);
    write_all(directory / name, {});
    EXPECT_TRUE(read_points(directory / name).empty());
  }
}

TEST(PointWriter, GivesTheSameBytesEveryTime) {
  const TestDirectory directory;
  for (const std::string extension : {".ply", ".pcd", ".las", ".csv"}) {
    write_all(directory / ("1" + extension), sample_points(100), kNearby);
    write_all(directory / ("2" + extension), sample_points(100), kNearby);
    EXPECT_EQ(file_bytes(directory / ("1" + extension)), file_bytes(directory / ("2" + extension)));
  }
}

TEST(PointWriter, LeavesNothingWithoutFinish) {
  const TestDirectory directory;
  for (const char* name : {"u.ply", "u.pcd", "u.las", "u.csv"}) {
    create_point_cloud(directory / name, kNearby)->write(sample_points(10));
    EXPECT_TRUE(std::filesystem::is_empty(directory / "")) << name;
  }
}

TEST(PointWriter, RefusesUnknownExtensionsAndFoldersThatAreNotThere) {
  const TestDirectory directory;
  for (const char* name : {"cloud.laz", "cloud", "cloud.ply.gz"}) {
    EXPECT_EQ(error_of([&] { static_cast<void>(create_point_cloud(directory / name)); }).code(),
              ErrorCode::kUsage);
  }
  EXPECT_EQ(
      error_of([&] { static_cast<void>(create_point_cloud(directory / "no/cloud.ply")); }).code(),
      ErrorCode::kIo);
}

}  // namespace
}  // namespace gdfmap::io_test
