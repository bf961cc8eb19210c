#include "io_test_support.hpp"

namespace gdfmap::io_test {
namespace {

constexpr std::uint16_t kFormatBytes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};

LasFile two_points(int minor, int format) {
  LasFile las;
  las.minor = minor;
  las.format = format;
  las.header_bytes = static_cast<std::uint16_t>(minor == 4 ? 375 : minor == 3 ? 235 : 227);
  las.record_bytes = kFormatBytes[format];
  las.count = minor == 4 ? 2 : 0;
  las.legacy_count = minor == 4 ? 0 : 2;
  las.offset = {637291.0, 851210.0, 511.0};
  las.add(-100, 200, 2147483647);
  las.add(1, -2, 3);
  return las;
}

const Points kTwoPoints = {
    {-100 * 0.01 + 637291.0, 200 * 0.01 + 851210.0, 2147483647 * 0.01 + 511.0},
    {1 * 0.01 + 637291.0, -2 * 0.01 + 851210.0, 3 * 0.01 + 511.0}};

TEST(LasReader, ReadsEveryVersionAndFormat) {
  const TestDirectory directory;
  for (int minor = 0; minor <= 4; ++minor) {
    for (int format = 0; format <= 10; ++format) {
      SCOPED_TRACE("LAS 1." + std::to_string(minor) + " format " + std::to_string(format));
      const auto reader =
          open_point_cloud(directory.write("v.las", two_points(minor, format).bytes()));
      EXPECT_EQ(reader->info().format,
                "LAS 1." + std::to_string(minor) + " format " + std::to_string(format));
      EXPECT_EQ(reader->info().num_points, 2u);
      expect_points(read_rest(*reader), kTwoPoints);
      EXPECT_EQ(reader->num_withheld(), 0u);
    }
  }
}

TEST(LasReader, TakesTheRecordLengthFromTheHeader) {
  const TestDirectory directory;
  LasFile las = two_points(2, 3);
  las.record_bytes = 41;  // 7 extra bytes
  las.records.clear();
  las.add(-100, 200, 2147483647);
  las.add(1, -2, 3);
  expect_points(read_points(directory.write("r.las", las.bytes())), kTwoPoints);
}

TEST(LasReader, FindsThePointsBehindOtherRecordsAndIgnoresWhatFollows) {
  const TestDirectory directory;
  LasFile las = two_points(4, 6);
  las.padding = 3'000'000;  // longer than the buffer
  expect_points(read_points(directory.write("p.las", las.bytes() + "extended records")),
                kTwoPoints);
}

TEST(LasReader, PassesOverWithheldPointsAndCountsThem) {
  const TestDirectory directory;
  for (const auto& [format, withheld, kept] :
       {std::tuple{0, 0x80, 0x7f}, std::tuple{5, 0x82, 0x04}, std::tuple{6, 0x04, 0xfb},
        std::tuple{10, 0xff, 0x80}}) {
    SCOPED_TRACE(format);
    LasFile las = two_points(4, format);
    las.records.clear();
    las.count = 5;
    for (const int flags : {withheld, kept, withheld, kept, withheld}) {
      las.add(flags == kept ? 1 : 99, 2, 3, flags);
    }
    las.offset.setZero();
    const auto path = directory.write("w.las", las.bytes());
    for (const std::size_t span : {1u, 2u, 100u}) {
      const auto reader = open_point_cloud(path);
      const Vector3 p(1 * 0.01, 2 * 0.01, 3 * 0.01);
      expect_points(read_rest(*reader, span), {p, p});
      EXPECT_EQ(reader->num_withheld(), 3u);
    }
  }
}

TEST(LasReader, PrefersThe64BitCountAndFallsBackToTheOldOne) {
  const TestDirectory directory;
  LasFile las = two_points(4, 1);
  las.legacy_count = 1;
  EXPECT_EQ(read_points(directory.write("n.las", las.bytes())).size(), 2u);
  las.count = 0;
  EXPECT_EQ(read_points(directory.write("o.las", las.bytes())).size(), 1u);
}

TEST(LasReader, ReadsAnEmptyCloud) {
  const TestDirectory directory;
  LasFile las = two_points(2, 0);
  las.legacy_count = 0;
  las.records.clear();
  EXPECT_TRUE(read_points(directory.write("e.las", las.bytes())).empty());
}

TEST(LasReader, RefusesLazAndNamesTheRemedy) {
  const TestDirectory directory;
  for (const int bit : {0x80, 0x40, 0xc0}) {
    LasFile las = two_points(2, 3);
    las.format |= bit;
    const auto path = directory.write("z.laz", las.bytes());
    const Error error = error_of([&] { static_cast<void>(open_point_cloud(path)); });
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    for (const char* part : {"LAZ", "laszip", "pdal translate", " -"}) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }
}

TEST(LasReader, RefusesACountThatTheFileCannotHold) {
  const TestDirectory directory;
  LasFile las = two_points(4, 6);
  las.count = 3;
  expect_corrupt(directory.write("c.las", las.bytes()),
                 "declares 3 points of at least 30 bytes, but only 60");
  las.count = ~std::uint64_t{0};
  expect_corrupt(directory.write("d.las", las.bytes()), "declares 18446744073709551615 points");
  const std::string whole = two_points(2, 0).bytes();
  expect_corrupt(directory.write("t.las", whole.substr(0, whole.size() - 1)),
                 "declares 2 points of at least 20 bytes, but only 39");
}

TEST(LasReader, RefusesDamagedHeaders) {
  const TestDirectory directory;
  const auto expect = [&](const std::string& part, const auto& damage) {
    SCOPED_TRACE(part);
    LasFile las = two_points(2, 0);
    damage(las);
    expect_corrupt(directory.write("h.las", las.bytes()), part);
  };
  expect("version 1.5 is not", [](LasFile& l) { l.minor = 5; });
  expect("point format 11 is not", [](LasFile& l) { l.format = 11; });
  expect("too short for point format 1", [](LasFile& l) { l.format = 1; });
  expect("too short for point format 0", [](LasFile& l) { l.record_bytes = 0; });
  expect("header of 227 bytes is too short for version 1.4", [](LasFile& l) { l.minor = 4; });
  expect("inside the header", [](LasFile& l) { l.points_offset = 100; });
  expect("behind the end", [](LasFile& l) { l.points_offset = 4'000'000'000u; });
  expect("scale or offset", [](LasFile& l) { l.scale = 0.0; });
  expect("scale or offset", [](LasFile& l) { l.scale = std::nan(""); });
  expect("scale or offset", [](LasFile& l) { l.offset.y() = HUGE_VAL; });
  expect_corrupt(directory.write("s.las", "LASF"), "file ends inside the LAS header");
}

}  // namespace
}  // namespace gdfmap::io_test
