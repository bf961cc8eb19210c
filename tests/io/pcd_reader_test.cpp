#include "io_test_support.hpp"

namespace gdfmap::io_test {
namespace {

const Points kTwoPoints = {{1.5, -2.25, 3.0}, {4.0, 5.5, -6.75}};

struct Pcd {
  std::string fields = "x y z", sizes = "4 4 4", types = "F F F", counts = "1 1 1";
  std::string size_lines = "WIDTH 2\nHEIGHT 1\nPOINTS 2\n";

  std::string header(const std::string& data) const {
    return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " +
           sizes + "\nTYPE " + types + "\nCOUNT " + counts + "\n" + size_lines +
           "VIEWPOINT 1 2 3 0 1 0 0\nDATA " + data + "\n";
  }
};

const std::string kTwoFloatRecords = raw_list({1.5f, -2.25f, 3.0f, 4.0f, 5.5f, -6.75f});
const std::string kTwoFloatColumns = raw_list({1.5f, 4.0f, -2.25f, 5.5f, 3.0f, -6.75f});

TEST(PcdReader, ReadsAsciiBinaryAndCompressed) {
  const TestDirectory directory;
  const auto expect = [&](const std::string& data, const std::string& body) {
    SCOPED_TRACE(data);
    const auto reader = open_point_cloud(directory.write("p.pcd", Pcd().header(data) + body));
    EXPECT_EQ(reader->info().format, "PCD " + data);
    EXPECT_EQ(reader->info().num_points, 2u);
    expect_points(read_rest(*reader), kTwoPoints);
  };
  expect("ascii", "1.5 -2.25 3\n4 5.5 -6.75\n");
  expect("binary", kTwoFloatRecords);
  expect("binary_compressed", compressed_body(kTwoFloatColumns));
}

TEST(PcdReader, TellsWhereTheSensorStoodAndMovesNoPoint) {
  const TestDirectory directory;
  const auto open = [&](const std::string& viewpoint) {
    std::string header = Pcd().header("ascii");
    const std::string usual = "VIEWPOINT 1 2 3 0 1 0 0\n";
    header.replace(header.find(usual), usual.size(), viewpoint);
    return open_point_cloud(directory.write("v.pcd", header + "1.5 -2.25 3\n4 5.5 -6.75\n"));
  };
  const auto turned = open("VIEWPOINT 1 2 3 0 1 0 0\n");
  EXPECT_EQ(turned->info().sensor_origin, Vector3(1, 2, 3));
  EXPECT_TRUE(turned->info().has_sensor_rotation);
  expect_points(read_rest(*turned), kTwoPoints);
  const auto moved = open("VIEWPOINT -1.5e3 2 3 1 0 0 0\n");
  EXPECT_EQ(moved->info().sensor_origin, Vector3(-1500, 2, 3));
  EXPECT_FALSE(moved->info().has_sensor_rotation);
  // The one that every writer puts there, none, and what is none, say nothing.
  for (const char* const nothing : {"VIEWPOINT 0 0 0 1 0 0 0\n", "", "VIEWPOINT 1 2 3\n",
                                    "VIEWPOINT 1 2 nan 1 0 0 0\n", "VIEWPOINT a b\n"}) {
    const auto reader = open(nothing);
    EXPECT_FALSE(reader->info().sensor_origin) << nothing;
    expect_points(read_rest(*reader), kTwoPoints);
  }
}

TEST(PcdReader, ReadsPaddingAndRepeatedFields) {
  const TestDirectory directory;
  Pcd pcd;
  pcd.fields = "_ x histogram y _ z";
  pcd.sizes = "1 4 2 4 1 4";
  pcd.types = "U F I F U F";
  pcd.counts = "3 1 2 1 4 1";
  const auto record = [](float x, float y, float z) {
    return "pad" + raw(x) + "hist" + raw(y) + "____" + raw(z);
  };
  expect_points(
      read_points(directory.write(
          "b.pcd", pcd.header("binary") + record(1.5f, -2.25f, 3.0f) + record(4.0f, 5.5f, -6.75f))),
      kTwoPoints);
  expect_points(read_points(directory.write("a.pcd", pcd.header("ascii") +
                                                         "0 0 0 1.5 8 8 -2.25 0 0 0 0 3\n"
                                                         "0 0 0 4 8 8 5.5 0 0 0 0 -6.75\n")),
                kTwoPoints);
}

TEST(PcdReader, ReadsCompressedDataWithAndWithoutThePadding) {
  const TestDirectory directory;
  Pcd pcd;
  pcd.fields = "_ x y _ z";
  pcd.sizes = "1 4 4 1 4";
  pcd.types = "U F F U F";
  pcd.counts = "3 1 1 4 1";
  const std::string x = raw_list({1.5f, 4.0f}), y = raw_list({-2.25f, 5.5f}),
                    z = raw_list({3.0f, -6.75f});
  const std::string text = pcd.header("binary_compressed");
  expect_points(read_points(directory.write("w.pcd", text + compressed_body(x + y + z))),
                kTwoPoints);
  expect_points(read_points(directory.write(
                    "k.pcd", text + compressed_body("padpad" + x + y + "________" + z))),
                kTwoPoints);
}

TEST(PcdReader, ReadsDoubleAndIntegerCoordinatesAndUpperCaseNames) {
  const TestDirectory directory;
  Pcd pcd;
  pcd.fields = "intensity X Y Z";
  pcd.sizes = "1 8 2 4";
  pcd.types = "U F I U";
  pcd.counts = "1 1 1 1";
  pcd.size_lines = "WIDTH 1\nHEIGHT 1\nPOINTS 1\n";
  const std::string record =
      "i" + raw(5334567.987654321) + raw(std::int16_t{-7}) + raw(std::uint32_t{4000000000u});
  const Points expected = {{5334567.987654321, -7, 4000000000.0}};
  expect_points(read_points(directory.write("b.pcd", pcd.header("binary") + record)), expected);
  expect_points(read_points(directory.write(
                    "c.pcd", pcd.header("binary_compressed") + compressed_body(record))),
                expected);
}

TEST(PcdReader, TakesTheCountFromWidthAndHeightWherePointsIsMissing) {
  const TestDirectory directory;
  Pcd pcd;
  pcd.size_lines = "WIDTH 1\nHEIGHT 2\n";
  expect_points(read_points(directory.write("h.pcd", pcd.header("binary") + kTwoFloatRecords)),
                kTwoPoints);
  pcd.size_lines = "WIDTH 2\n";
  expect_points(read_points(directory.write("w.pcd", pcd.header("binary") + kTwoFloatRecords)),
                kTwoPoints);
}

TEST(PcdReader, ReadsOldHeadersWithoutSizeTypeAndCount) {
  const TestDirectory directory;
  const auto path =
      directory.write("o.pcd",
                      "VERSION .5\r\nCOLUMNS x y z\r\nPOINTS 2\r\nDATA ascii\r\n1.5 -2.25 3\r\n\r\n"
                      "4 5.5 -6.75");
  expect_points(read_points(path), kTwoPoints);
}

TEST(PcdReader, ReadsBinaryDataBehindACrLfHeader) {
  const TestDirectory directory;
  std::string text;
  for (const char c : Pcd().header("binary"))
    text += c == '\n' ? std::string("\r\n") : std::string(1, c);
  expect_points(read_points(directory.write("c.pcd", text + kTwoFloatRecords)), kTwoPoints);
}

TEST(PcdReader, KeepsNotANumberOfOrganisedClouds) {
  const TestDirectory directory;
  const float nan = std::nanf("");
  const Points expected = {{nan, nan, nan}, {1, 2, 3}};
  expect_points(
      read_points(directory.write("a.pcd", Pcd().header("ascii") + "nan nan nan\n1 2 3\n")),
      expected);
  expect_points(read_points(directory.write(
                    "b.pcd", Pcd().header("binary") + raw_list({nan, nan, nan, 1.0f, 2.0f, 3.0f}))),
                expected);
}

TEST(PcdReader, ReadsAnEmptyCloud) {
  const TestDirectory directory;
  Pcd pcd;
  pcd.size_lines = "WIDTH 0\nHEIGHT 1\nPOINTS 0\n";
  for (const std::string data : {"ascii", "binary", "binary_compressed"}) {
    EXPECT_TRUE(read_points(directory.write("e.pcd", pcd.header(data))).empty()) << data;
  }
}

/// Data of many chunks whose matches reach back as far as they can and overlap themselves.
TEST(PcdReader, StreamsLongCompressedColumns) {
  const TestDirectory directory;
  constexpr std::size_t kCount = 60'000;
  std::string columns[3];
  Points expected(kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    // A long run of one value, a period of 2048 values (8192 bytes), and noise in one byte.
    const auto x = static_cast<float>(i < kCount / 2 ? 7 : i % 2048);
    const auto y = static_cast<float>(i * 2654435761u % 1000);
    const auto z = static_cast<float>(i % 3);
    expected[i] = Vector3(x, y, z);
    columns[0] += raw(x);
    columns[1] += raw(y);
    columns[2] += raw(z);
  }
  Pcd pcd;
  pcd.fields = "rgb z x normal y";
  pcd.sizes = "4 4 4 4 4";
  pcd.types = "U F F F F";
  pcd.counts = "1 1 1 3 1";
  pcd.size_lines = "WIDTH 60000\nHEIGHT 1\nPOINTS 60000\n";
  const std::string data = std::string(4 * kCount, 'c') + columns[2] + columns[0] +
                           std::string(12 * kCount, '\0') + columns[1];
  const auto path = directory.write(
      "l.pcd", pcd.header("binary_compressed") + compressed_body(data) + "bytes behind it");
  for (const std::size_t span : {std::size_t{1}, std::size_t{5000}, kCount}) {
    expect_points(read_points(path, span), expected);
  }
}

TEST(PcdReader, RefusesDamagedCompressedData) {
  const TestDirectory directory;
  const std::string text = Pcd().header("binary_compressed");
  const auto sizes = [](std::uint32_t packed, std::uint32_t plain) {
    return raw_list({packed, plain});
  };
  expect_corrupt(directory.write("s.pcd", text + "1234"), "file ends before the sizes");
  expect_corrupt(directory.write("l.pcd", text + sizes(100, 24) + "short"), "declares 100");
  expect_corrupt(directory.write("p.pcd", text + sizes(2, 25) + "ab"), "2 points of 12 bytes");
  // A reference to before the first byte; a command that is cut; too few bytes; too many.
  expect_corrupt(directory.write("r.pcd", text + sizes(2, 24) + "\x20\x05"), "damaged");
  expect_corrupt(directory.write("c.pcd", text + sizes(3, 24) +
                                              "\x05"
                                              "ab"),
                 "damaged");
  expect_corrupt(directory.write("f.pcd", text + sizes(3, 24) +
                                              "\x01"
                                              "ab"),
                 "damaged");
  expect_corrupt(directory.write("m.pcd", text + sizes(26, 24) + "\x18" + std::string(25, 'm')),
                 "damaged");
}

TEST(PcdReader, RefusesACountThatTheFileCannotHold) {
  const TestDirectory directory;
  Pcd pcd;
  pcd.size_lines = "WIDTH 3000000000\nHEIGHT 3000000000\n";
  expect_corrupt(directory.write("b.pcd", pcd.header("binary") + kTwoFloatRecords),
                 "declares 9000000000000000000 points of at least 12 bytes, but only 24");
  expect_corrupt(directory.write("a.pcd", pcd.header("ascii") + "1 2 3\n"), "declares 9000000000");
  expect_corrupt(
      directory.write("c.pcd", pcd.header("binary_compressed") + compressed_body(kTwoFloatColumns)),
      "declares 9000000000000000000 points");
  pcd.size_lines = "WIDTH 30000000000\nHEIGHT 3000000000\n";
  expect_corrupt(directory.write("o.pcd", pcd.header("binary") + kTwoFloatRecords),
                 "no number of points");
  pcd.size_lines = "WIDTH 2\nHEIGHT 1\nPOINTS 1\n";
  expect_corrupt(directory.write("m.pcd", pcd.header("binary") + kTwoFloatRecords),
                 "declares 1 points, but WIDTH 2 and HEIGHT 1");
}

TEST(PcdReader, SaysWhichPointOfAnAsciiFileIsMissingOrDamaged) {
  const TestDirectory directory;
  const std::string text = Pcd().header("ascii");
  expect_corrupt(directory.write("t.pcd", text + "1.0 2.0 3.0\n"), "point 2 of 2: file ends");
  expect_corrupt(directory.write("s.pcd", text + "1 2 3\n4.0 5\n"), "point 2 of 2: line ends");
  expect_corrupt(directory.write("n.pcd", text + "1 2 3\n4 y 6\n"),
                 "point 2 of 2: 'y' is not a number");
}

TEST(PcdReader, RefusesDamagedHeaders) {
  const TestDirectory directory;
  const auto expect = [&](const Pcd& pcd, const std::string& data, const std::string& part) {
    SCOPED_TRACE(part);
    expect_corrupt(directory.write("h.pcd", pcd.header(data) + kTwoFloatRecords), part);
  };
  expect({}, "bin", "unknown DATA 'bin'");
  expect({.fields = "x y w"}, "binary", "no field z");
  expect({.fields = "x y z w"}, "binary", "line 4: fewer values than FIELDS");
  expect({.fields = "x y"}, "binary", "line 4: more values than FIELDS");
  expect({.sizes = "4 4 3"}, "binary", "a SIZE is not");
  expect({.types = "F F Q"}, "binary", "a TYPE is not");
  expect({.sizes = "4 4 2"}, "binary", "field z has TYPE F and SIZE 2");
  expect({.counts = "1 0 1"}, "binary", "a COUNT is out of range");
  expect({.counts = "1 1 4294967296"}, "binary", "a COUNT is out of range");
  expect({.counts = "1 1 300000"}, "binary", "points of 1200008 bytes");
  expect({.size_lines = ""}, "binary", "neither POINTS nor WIDTH");
  expect({.size_lines = "POINTS many\n"}, "binary", "'many' is not a whole number");
  expect({.size_lines = "POINT 2\n"}, "binary", "unknown keyword 'POINT'");
  expect_corrupt(directory.write("e.pcd", "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\n"),
                 "file ends inside the PCD header");
}

}  // namespace
}  // namespace gdfmap::io_test
